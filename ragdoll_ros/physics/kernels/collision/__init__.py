"""Narrow phase: contact manifolds and distances of two shapes. Broad phase: sweep and prune."""
