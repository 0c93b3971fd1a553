"""What shapes are to one who looks for contacts: extents, farthest points, distances.

Kinds and sizes: sphere (r, 0, 0); capsule (r, half length without its ends, 0); box (half extents);
cylinder (r, half length, 0). The last three are centred, capsules and cylinders along their own z.
All are symmetric about their centre, so that a direction and its opposite have one extent.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled

SPHERE, CAPSULE, BOX, CYLINDER = 0, 1, 2, 3


@compiled
def into(r: np.ndarray, x: float, y: float, z: float) -> tuple[float, float, float]:
    """A vector of the world in a body's frame, whose rotation is ``r`` (3, 3)."""
    return (r[0, 0] * x + r[1, 0] * y + r[2, 0] * z, r[0, 1] * x + r[1, 1] * y + r[2, 1] * z,
            r[0, 2] * x + r[1, 2] * y + r[2, 2] * z)


@compiled
def out_of(r: np.ndarray, x: float, y: float, z: float) -> tuple[float, float, float]:
    """A vector of a body's frame in the world."""
    return (r[0, 0] * x + r[0, 1] * y + r[0, 2] * z, r[1, 0] * x + r[1, 1] * y + r[1, 2] * z,
            r[2, 0] * x + r[2, 1] * y + r[2, 2] * z)


@compiled
def bound(kind: int, size: np.ndarray) -> float:
    """Radius, m, of the sphere about the centre that holds the shape."""
    if kind == BOX:
        return math.sqrt(size[0] * size[0] + size[1] * size[1] + size[2] * size[2])
    if kind == CYLINDER:
        return math.sqrt(size[0] * size[0] + size[1] * size[1])
    return size[0] + size[1]


@compiled
def extent(kind: int, size: np.ndarray, r: np.ndarray, x: float, y: float, z: float) -> float:
    """How far, m, a shape reaches from its centre along a unit vector of the world.

    Of a capsule its axis alone: what is around it is the same along all vectors.
    """
    x, y, z = into(r, x, y, z)
    if kind == BOX:
        return size[0] * abs(x) + size[1] * abs(y) + size[2] * abs(z)
    if kind == CAPSULE:
        return size[1] * abs(z)
    return size[0] * math.sqrt(x * x + y * y) + size[1] * abs(z)


@compiled
def support(kind: int, size: np.ndarray, r: np.ndarray, x: float, y: float,
            z: float) -> tuple[float, float, float]:
    """The point of a shape, from its centre, that is farthest along a vector; see extent."""
    x, y, z = into(r, x, y, z)
    if kind == BOX:
        return out_of(r, math.copysign(size[0], x), math.copysign(size[1], y),
                      math.copysign(size[2], z))
    across = math.sqrt(x * x + y * y)
    radius = 0.0 if kind == CAPSULE or across == 0 else size[0] / across
    return out_of(r, x * radius, y * radius, math.copysign(size[1], z))


@compiled
def sideways(ux: float, uy: float) -> tuple[float, float, float]:
    """Unit vector at right angles to z and u, for a place from which all ways out are alike."""
    length = math.sqrt(ux * ux + uy * uy)
    if length < 1e-12:
        return 1.0, 0.0, 0.0
    return uy / length, -ux / length, 0.0


@compiled
def distance(kind: int, size: np.ndarray, x: float, y: float, z: float, ux: float,
             uy: float) -> tuple[float, float, float, float]:
    """Signed distance, m, of a point of the shape's frame from its surface, and its gradient.

    It is convex, as the shapes are. Where the gradient is not unique it is at right angles to u,
    the axis of what is asked for. Ericson, Real-Time Collision Detection (2005), section 5.1.
    """
    if kind == BOX:
        return _box_distance(size, x, y, z)
    if kind == CYLINDER:
        return _cylinder_distance(size, x, y, z, ux, uy)
    if kind == CAPSULE:
        z -= min(max(z, -size[1]), size[1])
    length = math.sqrt(x * x + y * y + z * z)
    if length < 1e-12:
        x, y, z = sideways(ux, uy)
        return -size[0], x, y, z
    return length - size[0], x / length, y / length, z / length


@compiled
def _box_distance(size: np.ndarray, x: float, y: float,
                  z: float) -> tuple[float, float, float, float]:
    a, b, c = abs(x) - size[0], abs(y) - size[1], abs(z) - size[2]
    if a <= 0 and b <= 0 and c <= 0:
        if c >= a and c >= b:
            return c, 0.0, 0.0, math.copysign(1.0, z)
        if b >= a:
            return b, 0.0, math.copysign(1.0, y), 0.0
        return a, math.copysign(1.0, x), 0.0, 0.0
    a, b, c = max(a, 0.0), max(b, 0.0), max(c, 0.0)
    length = math.sqrt(a * a + b * b + c * c)
    return (length, math.copysign(a, x) / length, math.copysign(b, y) / length,
            math.copysign(c, z) / length)


@compiled
def _cylinder_distance(size: np.ndarray, x: float, y: float, z: float, ux: float,
                       uy: float) -> tuple[float, float, float, float]:
    across = math.sqrt(x * x + y * y)
    a, c = across - size[0], abs(z) - size[1]
    if across < 1e-12:
        x, y, _ = sideways(ux, uy)
    else:
        x, y = x / across, y / across
    if a <= 0 and c <= 0:
        if c >= a:
            return c, 0.0, 0.0, math.copysign(1.0, z)
        return a, x, y, 0.0
    a, c = max(a, 0.0), max(c, 0.0)
    length = math.sqrt(a * a + c * c)
    return length, x * a / length, y * a / length, math.copysign(c, z) / length
