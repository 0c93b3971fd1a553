"""A run as poses over time, and the files that it is written to and read from."""
