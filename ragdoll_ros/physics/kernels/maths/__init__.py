"""Vectors, rotations, sines and small systems of equations, in scalar operations."""
