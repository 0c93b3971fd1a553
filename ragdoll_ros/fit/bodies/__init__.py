"""Masses of bodies, and overlaps between them."""
