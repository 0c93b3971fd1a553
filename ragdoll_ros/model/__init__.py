"""What a scene is: frozen, checked data; no motion, no files, no engine."""
