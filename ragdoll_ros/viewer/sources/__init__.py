"""Where the states that the page shows come from."""
