"""Whether to believe a doll."""
