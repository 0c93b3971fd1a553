"""Plane: a half space as the shape of a static body."""
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

DRAWN_SIZE = 100.0
"""m: edge of the square that is drawn of a plane."""


@dataclass(frozen=True)
class Plane:
    """The half space below its own x-y plane, without end; its z axis is the normal. Static bodies
    alone have it.

    Example:
        >>> StaticBody('shelf', Plane(), position=(0, 0, 0.2)).normal
        (0.0, 0.0, 1.0)
    """

    kind: ClassVar[str] = 'plane'
    parts: ClassVar[tuple] = ()
    """It has no solid parts of a size."""
    primitives: ClassVar[tuple] = ()

    def mesh(self) -> tuple[np.ndarray, np.ndarray]:
        """Vertices (4, 3) m and triangles (2, 3) of a square to draw, seen from above."""
        corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
        return DRAWN_SIZE / 2 * corners, np.array([[0, 1, 2], [0, 2, 3]])
