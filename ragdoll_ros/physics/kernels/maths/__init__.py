"""Vectors, rotations, sines and small systems of equations, number by number."""
