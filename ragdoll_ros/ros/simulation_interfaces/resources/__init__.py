"""What services load: worlds, which are scenes, and dolls that are spawned."""
