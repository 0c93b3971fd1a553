"""Recorded runs: reading, repeating to the bit, comparing."""
