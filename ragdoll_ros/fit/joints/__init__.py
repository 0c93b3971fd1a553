"""Kinds, axes and ranges of joints."""
