"""Checks of a doll, and the verdict on it."""
