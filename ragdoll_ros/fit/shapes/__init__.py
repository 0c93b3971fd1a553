"""Axes and shapes of a cloud of points."""
