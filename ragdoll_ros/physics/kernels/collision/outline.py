"""What boxes and cylinders show along a direction: a face, an edge, a line of a side."""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from .shapes import BOX, into, out_of

SQUARE = 0.1
"""Sine of the angle to n up to which a face, an edge or a line of a side counts as square to n."""

LYING = 0.7
"""Cosine between n and a cylinder's axis up to which it shows its side."""

SLANT = math.sqrt(0.5)
DISC = np.array(((1, 0), (SLANT, SLANT), (0, 1), (-SLANT, SLANT),
                 (-1, 0), (-SLANT, -SLANT), (0, -1), (SLANT, -SLANT)))
CORNERS = len(DISC)
"""Corners of a disc of radius 1."""


@compiled
def outline(kind: int, size: np.ndarray, r: np.ndarray, x: float, y: float, z: float, tx: float,
            ty: float, tz: float, corners: np.ndarray) -> tuple[int, int]:
    """Put the corners (k, 3), from the centre, world, of what a body shows along the unit vector.

    Gives k (4: face, 8: cap, 2: line) and the face's number. A cap has the corners of a regular
    octagon, but that the one next to the place that is farthest along the vector stands there; if
    none is, the one next to the way ``t``.
    """
    x, y, z = into(r, x, y, z)
    if kind == BOX:
        return 4, _face(size, r, x, y, z, corners)
    across, end = math.sqrt(x * x + y * y), math.copysign(size[1], z)
    if abs(z) <= LYING:
        a, b = x * size[0] / across, y * size[0] / across
        corners[0, 0], corners[0, 1], corners[0, 2] = out_of(r, a, b, -size[1])
        corners[1, 0], corners[1, 1], corners[1, 2] = out_of(r, a, b, size[1])
        return 2, 2
    if across < 1e-9:
        x, y, _ = into(r, tx, ty, tz)
        across = math.sqrt(x * x + y * y)
    deepest = 0
    for k in range(1, CORNERS):
        if x * DISC[k, 0] + y * DISC[k, 1] > x * DISC[deepest, 0] + y * DISC[deepest, 1]:
            deepest = k
    for k in range(CORNERS):
        a, b = DISC[k, 0], DISC[k, 1]
        if k == deepest and across > 1e-9:
            a, b = x / across, y / across
        corners[k, 0], corners[k, 1], corners[k, 2] = out_of(r, size[0] * a, size[0] * b, end)
    return CORNERS, 0 if z > 0 else 1


@compiled
def _face(size: np.ndarray, r: np.ndarray, x: float, y: float, z: float,
          corners: np.ndarray) -> int:
    """Corners of a box's face that looks most along a vector of its frame; gives its number."""
    axis, most = 2, z
    if abs(x) > abs(most):
        axis, most = 0, x
    if abs(y) > abs(most):
        axis, most = 1, y
    i, j = (axis + 1) % 3, (axis + 2) % 3
    top = math.copysign(size[axis], most)
    for k in range(4):
        a, b = size[i] * (1 if k == 0 or k == 3 else -1), size[j] * (1 if k < 2 else -1)
        for e in range(3):
            corners[k, e] = r[e, axis] * top + r[e, i] * a + r[e, j] * b
    return axis * 2 + (1 if most < 0 else 0)


@compiled
def squareness(kind: int, r: np.ndarray, x: float, y: float, z: float) -> float:
    """Cosine between the unit vector and the nearest normal of a box's face or a cylinder's cap."""
    x, y, z = into(r, x, y, z)
    return max(abs(x), abs(y), abs(z)) if kind == BOX else abs(z)


@compiled
def line(kind: int, size: np.ndarray, r: np.ndarray, x: float, y: float,
         z: float) -> tuple[float, float, float, float, float, float]:
    """Middle, from the centre, and half of the edge, or the line of a side, that is farthest along
    the unit vector, world; of a corner or a place on a rim, which has no length, half is 0.
    """
    x, y, z = into(r, x, y, z)
    a, b, c, d, e, f = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if kind == BOX:
        a, b, c = (math.copysign(size[0], x), math.copysign(size[1], y), math.copysign(size[2], z))
        least = min(abs(x), abs(y), abs(z))
        if least < SQUARE:
            if abs(x) == least:
                a, d = 0.0, size[0]
            elif abs(y) == least:
                b, e = 0.0, size[1]
            else:
                c, f = 0.0, size[2]
    else:
        across = math.sqrt(x * x + y * y)
        if across > 0:
            a, b = x * size[0] / across, y * size[0] / across
        if abs(z) < SQUARE:
            f = size[1]
        else:
            c = math.copysign(size[1], z)
    a, b, c = out_of(r, a, b, c)
    d, e, f = out_of(r, d, e, f)
    return a, b, c, d, e, f
