"""Recorded runs: read, repeated to the bit, compared."""
