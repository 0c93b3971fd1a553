"""The arrow keys' pushes, for all that steer the doll.

You look at the doll's face, from +x along -x: Up is away from you, Down toward you, Left and
Right as you see it.
"""
from __future__ import annotations

from collections.abc import Iterable

from .ragdoll import Vector

FORCES: dict[str, Vector] = {
    'up': (-2000.0, 0.0, 1.0), 'down': (2000.0, 0.0, 1.0),
    'right': (0.0, 2000.0, 1.0), 'left': (0.0, -2000.0, 1.0)}
"""N, world axes (the article's keys)."""


def total(arrows: Iterable[str]) -> Vector:
    """Sum of the forces of all these arrows, N."""
    forces = [FORCES[arrow] for arrow in arrows]
    return tuple(map(sum, zip(*forces, strict=True))) if forces else (0.0, 0.0, 0.0)
