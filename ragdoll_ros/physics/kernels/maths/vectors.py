"""Vectors, quaternions and rotation matrices as values: tuples of 3 and 4 numbers, x, y, z, w.

The order of operations within each function is fixed: results are the same to the bit everywhere.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled

Vec3 = tuple[float, float, float]
Quat = tuple[float, float, float, float]


@compiled
def vec(row: np.ndarray) -> Vec3:
    """The first three entries of an array."""
    return row[0], row[1], row[2]


@compiled
def quat(row: np.ndarray) -> Quat:
    """The first four entries of an array."""
    return row[0], row[1], row[2], row[3]


@compiled
def column(m: np.ndarray, k: int) -> Vec3:
    """Column k of a matrix (3, 3): of a rotation, axis k of the rotated frame."""
    return m[0, k], m[1, k], m[2, k]


@compiled
def put(row: np.ndarray, a: Vec3) -> None:
    """Write a vector to the first three entries of ``row``."""
    row[0], row[1], row[2] = a


@compiled
def add(a: Vec3, b: Vec3) -> Vec3:
    """Sum a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@compiled
def sub(a: Vec3, b: Vec3) -> Vec3:
    """Difference a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@compiled
def neg(a: Vec3) -> Vec3:
    """Opposite -a."""
    return -a[0], -a[1], -a[2]


@compiled
def scale(s: float, a: Vec3) -> Vec3:
    """Product s a with a number."""
    return s * a[0], s * a[1], s * a[2]


@compiled
def divide(a: Vec3, s: float) -> Vec3:
    """Quotient a / s by a number."""
    return a[0] / s, a[1] / s, a[2] / s


@compiled
def add_scaled(a: Vec3, s: float, b: Vec3) -> Vec3:
    """Sum a + s b."""
    return a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]


@compiled
def dot(a: Vec3, b: Vec3) -> float:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def cross(a: Vec3, b: Vec3) -> Vec3:
    """Cross product a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled
def norm(a: Vec3) -> float:
    """Euclidean length."""
    return math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


@compiled
def to_world(r: np.ndarray, a: Vec3) -> Vec3:
    """Rotate a vector from a body's frame to the world's: r a, r the body's rotation (3, 3)."""
    return (r[0, 0] * a[0] + r[0, 1] * a[1] + r[0, 2] * a[2],
            r[1, 0] * a[0] + r[1, 1] * a[1] + r[1, 2] * a[2],
            r[2, 0] * a[0] + r[2, 1] * a[1] + r[2, 2] * a[2])


@compiled
def to_local(r: np.ndarray, a: Vec3) -> Vec3:
    """Rotate a vector from the world's frame to a body's: r^T a, r the body's rotation (3, 3)."""
    return (r[0, 0] * a[0] + r[1, 0] * a[1] + r[2, 0] * a[2],
            r[0, 1] * a[0] + r[1, 1] * a[1] + r[2, 1] * a[2],
            r[0, 2] * a[0] + r[1, 2] * a[1] + r[2, 2] * a[2])


@compiled
def quat_mul(p: Quat, q: Quat) -> Quat:
    """Return the Hamilton product p q, components x, y, z, w: the rotation q followed by p."""
    return (p[3] * q[0] + p[0] * q[3] + p[1] * q[2] - p[2] * q[1],
            p[3] * q[1] - p[0] * q[2] + p[1] * q[3] + p[2] * q[0],
            p[3] * q[2] + p[0] * q[1] - p[1] * q[0] + p[2] * q[3],
            p[3] * q[3] - p[0] * q[0] - p[1] * q[1] - p[2] * q[2])


@compiled
def quat_conj(q: Quat) -> Quat:
    """Conjugate: the inverse of a unit quaternion."""
    return -q[0], -q[1], -q[2], q[3]


@compiled
def quat_rotate(q: Quat, a: Vec3) -> Vec3:
    """Rotate a vector by a unit quaternion: from the body's frame to the outer one."""
    x, y, z, w = q
    d, e, f = 2 * (y * a[2] - z * a[1]), 2 * (z * a[0] - x * a[2]), 2 * (x * a[1] - y * a[0])
    return a[0] + w * d + y * f - z * e, a[1] + w * e + z * d - x * f, a[2] + w * f + x * e - y * d


@compiled
def quat_rotate_inverse(q: Quat, a: Vec3) -> Vec3:
    """Rotate a vector by the inverse of a unit quaternion: from the outer frame to the body's."""
    return quat_rotate((q[0], q[1], q[2], -q[3]), a)


@compiled
def quat_to_matrix(q: Quat, out: np.ndarray) -> None:
    """Write the rotation matrix of a unit quaternion to ``out`` (3, 3)."""
    x, y, z, w = q
    out[0, 0] = x * x - y * y - z * z + w * w
    out[1, 1] = y * y - x * x - z * z + w * w
    out[2, 2] = z * z - x * x - y * y + w * w
    out[0, 1], out[1, 0] = 2 * (x * y - z * w), 2 * (x * y + z * w)
    out[0, 2], out[2, 0] = 2 * (x * z + y * w), 2 * (x * z - y * w)
    out[1, 2], out[2, 1] = 2 * (y * z - x * w), 2 * (y * z + x * w)
