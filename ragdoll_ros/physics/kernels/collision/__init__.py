"""Narrow phase: contact manifolds and distances of pairs of shapes."""
