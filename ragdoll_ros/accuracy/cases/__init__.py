"""Trials: random starts, hard cases, random scenes."""
