"""Anatomical roles of bones by name, and whether a skeleton is a person's."""
