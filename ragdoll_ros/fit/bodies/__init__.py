"""What bodies weigh, and where they may not be in each other."""
