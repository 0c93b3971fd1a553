"""What is done by numpy where numba is missing: twins of what is compiled."""
