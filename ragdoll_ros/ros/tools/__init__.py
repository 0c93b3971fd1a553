"""Benchmarks, the soak test, and topic statistics."""
