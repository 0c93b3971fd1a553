"""What acts on a simulation: pushes, grabs, joint springs."""
