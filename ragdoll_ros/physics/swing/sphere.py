"""Logarithm and exponential map of the unit sphere, vectorized; all vectors are (3, n)."""
import numpy as np

_SMALLEST = 1e-150
"""Avoids 0/0; vanishes in rounding beside any other length."""

_YZX = np.array([1, 2, 0])


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Scalar products (n,)."""
    return np.einsum('in,in->n', a, b)


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross products (3, n)."""
    turned = a * b.take(_YZX, axis=0)
    turned -= b * a.take(_YZX, axis=0)
    return turned.take(_YZX, axis=0)


def log_map(d: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Logarithm map: tangents (3, n) rad at ``d`` that point to ``target``, as long as the arc.

    Zero for the antipode, where it is not defined.
    """
    cos = dot(d, target)
    across = target - cos * d
    sin = np.sqrt(dot(across, across))
    across *= np.arctan2(sin, cos) / (sin + _SMALLEST)
    return across


def exp_map(d: np.ndarray, x: np.ndarray, *tangents: np.ndarray) -> list[np.ndarray]:
    """Exponential map of tangents ``x`` at ``d``, and parallel transport of ``tangents`` at d.

    Returns the new directions, of unit length to rounding, and each transported tangent.
    """
    half = np.sqrt(dot(x, x)) / 2 + _SMALLEST
    # The tangent of the half angle is cheaper than sine and cosine of the whole.
    tan = np.tan(half)
    square = tan * tan
    scale = 1 / (1 + square)
    ratio = tan / half
    slope = ratio * scale  # sin |x| / |x|
    end = ((1 - square) * scale) * d + slope * x
    end /= np.sqrt(dot(end, end))
    lost = (ratio / 2) * (d + end)
    return [end, *(v - dot(x, v) * lost for v in tangents)]
