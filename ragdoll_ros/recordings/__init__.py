"""Recordings: poses of a run over time, and their file formats."""
