"""Narrow phase of a shape and a triangle of a surface: axis, gap and manifold."""
