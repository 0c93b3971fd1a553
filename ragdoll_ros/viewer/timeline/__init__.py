"""The timeline: what was shown, to be scrubbed, replayed and exported."""
