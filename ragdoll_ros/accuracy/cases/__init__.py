"""What is tried: trials, hard cases, starts."""
