"""The source that listens to a running node."""
