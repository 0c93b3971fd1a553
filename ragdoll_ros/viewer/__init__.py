"""A page in the browser: shows the scene live, grabs, pushes, edits, records."""
