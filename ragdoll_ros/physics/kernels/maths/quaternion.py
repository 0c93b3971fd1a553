"""Vectors and rotations, number by number: quaternions are x, y, z, w."""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled


@compiled
def times(ax: float, ay: float, az: float, aw: float, bx: float, by: float, bz: float,
          bw: float) -> tuple[float, float, float, float]:
    """Hamilton product a * b of two quaternions: first b, then a."""
    return (aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz)


@compiled
def turned(x: float, y: float, z: float, w: float, a: float, b: float,
           c: float) -> tuple[float, float, float]:
    """The vector (a, b, c) of a body's frame in the outer frame; with -w: the other way."""
    d, e, f = 2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)
    return a + w * d + y * f - z * e, b + w * e + z * d - x * f, c + w * f + x * e - y * d


@compiled
def cross(ax: float, ay: float, az: float, bx: float, by: float,
          bz: float) -> tuple[float, float, float]:
    """Cross product of two vectors."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@compiled
def to_matrix(x: float, y: float, z: float, w: float, out: np.ndarray) -> None:
    """Rotation matrix (3, 3) of a quaternion."""
    out[0, 0] = x * x - y * y - z * z + w * w
    out[1, 1] = y * y - x * x - z * z + w * w
    out[2, 2] = z * z - x * x - y * y + w * w
    out[0, 1], out[1, 0] = 2 * (x * y - z * w), 2 * (x * y + z * w)
    out[0, 2], out[2, 0] = 2 * (x * z + y * w), 2 * (x * z - y * w)
    out[1, 2], out[2, 1] = 2 * (y * z - x * w), 2 * (y * z + x * w)
