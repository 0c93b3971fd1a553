"""Plane: a half space as the shape of a static body."""
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

LEVEL = 1 - 1e-12
"""Cosine from the normal, from which on a direction is along it."""

DRAWN_SIZE = 100.0
"""m: edge of the square that is drawn of a plane."""


@dataclass(frozen=True)
class Plane:
    """The half space below its own x-y plane, without end; its z axis is the normal. Only static
    bodies can have this shape.

    Example:
        >>> StaticBody('shelf', Plane(), position=(0, 0, 0.2)).normal
        (0.0, 0.0, 1.0)
    """

    kind: ClassVar[str] = 'plane'
    parts: ClassVar[tuple] = ()
    """It has no solid parts of a size."""
    primitives: ClassVar[tuple] = ()

    def support(self, direction: np.ndarray) -> np.ndarray:
        """Support function (...,) m along unit directions (..., 3): 0 along the normal, infinite
        along others.
        """
        return np.where(np.asarray(direction, float)[..., 2] > LEVEL, 0.0, np.inf)

    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        """Height (p,) m of points (p, 3) above it."""
        return np.asarray(points, float)[:, 2]

    def mesh(self) -> tuple[np.ndarray, np.ndarray]:
        """Vertices (4, 3) m and triangles (2, 3) of a square to draw, seen from above."""
        corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
        return DRAWN_SIZE / 2 * corners, np.array([[0, 1, 2], [0, 2, 3]])
