"""Sources of the states that the page shows."""
