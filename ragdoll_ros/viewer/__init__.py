"""The page in the browser: viser, and what it shows."""
