"""Simulated time beside the clock on the wall: the pacer, and keys that are held."""
