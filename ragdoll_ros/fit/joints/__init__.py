"""Joint kinds, axes, limits and damping."""
