"""Other engines as the report runs them: plain steps, without help from this package."""
