"""Anatomical roles of bones by name: of characters, dolls and motion capture."""
