"""Swings as machine code: chains of springs and pendulums on bones, a whole scene in one call."""
