"""Keys of a terminal as pushes of a node."""
