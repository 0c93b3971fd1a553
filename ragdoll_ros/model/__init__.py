"""Scenes and dolls as frozen, validated data; no motion, no files, no engine."""
