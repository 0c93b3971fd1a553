"""Which bones become bodies, and how they hang together."""
