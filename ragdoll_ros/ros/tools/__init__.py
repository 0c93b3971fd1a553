"""Benchmarks, the soak test, and a listener."""
