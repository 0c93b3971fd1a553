"""Recordings as glTF, with and without a skin."""
