"""Directions as points of the unit sphere: the arc between two, and how to go along one.

All vectors are (3, n): component first, so that one operation runs over all directions.
"""
from __future__ import annotations

import numpy as np

_TINY = 1e-150
"""Keeps 0/0 away, and is lost in rounding beside any other length."""

_YZX = np.array([1, 2, 0])


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Scalar products (n,)."""
    return np.einsum('in,in->n', a, b)


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Vector products (3, n)."""
    turned = a * b.take(_YZX, axis=0)
    turned -= b * a.take(_YZX, axis=0)
    return turned.take(_YZX, axis=0)


def arc(d: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Tangents (3, n) at ``d`` along the shortest arc to ``target``, as long as that arc, rad.

    The opposite point has no shortest arc: zero there.
    """
    cos = dot(d, target)
    across = target - cos * d
    sin = np.sqrt(dot(across, across))
    across *= np.arctan2(sin, cos) / (sin + _TINY)
    return across


def along(d: np.ndarray, x: np.ndarray, *tangents: np.ndarray) -> list[np.ndarray]:
    """Go from ``d`` along its tangent ``x`` on a great circle; take ``tangents`` at d along.

    Gives the new directions, unit to rounding, and each tangent moved in parallel: same length,
    same angle to the great circle (the exponential map and the parallel transport of the sphere).
    """
    half = np.sqrt(dot(x, x)) / 2 + _TINY
    # One tangent of the half angle costs less than a sine and a cosine of the whole.
    tan = np.tan(half)
    square = tan * tan
    scale = 1 / (1 + square)
    ratio = tan / half
    slope = ratio * scale  # sin |x| / |x|
    end = ((1 - square) * scale) * d + slope * x
    end /= np.sqrt(dot(end, end))
    lost = (ratio / 2) * (d + end)
    return [end, *(v - dot(x, v) * lost for v in tangents)]
