"""Physics engines: one protocol, one file for each library."""
