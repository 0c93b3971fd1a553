"""Directions as points of the unit sphere: the arc between two, and how to go along one.

All vectors are (3, n): component first, so that one operation runs over all directions.
"""
from __future__ import annotations

import numpy as np


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Scalar products (n,)."""
    return np.einsum('in,in->n', a, b)


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Vector products (3, n)."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]
    return out


def arc(d: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Tangents (3, n) at ``d`` along the shortest arc to ``target``, as long as that arc, rad.

    The opposite point has no shortest arc: zero there.
    """
    cos = dot(d, target)
    across = target - cos * d
    sin = np.sqrt(dot(across, across))
    across *= np.arctan2(sin, cos) / np.maximum(sin, 1e-300)
    return across


def along(d: np.ndarray, x: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Go from ``d`` along its tangent ``x`` on a great circle; take the tangent ``v`` along.

    Gives the new directions, unit to rounding, and v moved in parallel: same length, same angle
    to the great circle (the exponential map and the parallel transport of the sphere).
    """
    half = np.sqrt(dot(x, x)) / 2
    sin, cos = np.sin(half), np.cos(half)
    # sin(2 half)/(2 half) and (1 - cos(2 half))/(2 half)^2
    ratio = sin / np.maximum(half, 1e-300)
    ratio[half < 1e-300] = 1
    slope, bend = ratio * cos, ratio * ratio / 2
    end = (1 - 2 * sin * sin) * d + slope * x
    end /= np.sqrt(dot(end, end))
    along_v = dot(x, v)
    moved = v - (along_v * slope) * d - (along_v * bend) * x
    return end, moved
