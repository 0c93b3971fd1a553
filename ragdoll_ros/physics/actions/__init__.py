"""Actions on a simulation: pushes, drives, grabs, joint springs."""
