"""Convex hulls: support function, distance and faces of a polyhedron."""
