"""Vectors and quaternions as plain tuples of floats: hashable, comparable, exact."""
from __future__ import annotations

import math

from . import errors

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


def floats(values: object) -> tuple[float, ...]:
    """Turn any sequence of numbers into a tuple of floats: hashable, comparable, exact."""
    return tuple(float(value) for value in values)


def unit(path: str, values: object,
         expected: str = 'a direction, not zero') -> tuple[float, ...]:
    """Scale to length one; NotUnit for zero."""
    values = floats(values)
    errors.check_finite(path, values)
    length = math.hypot(*values)
    if length < 1e-9:
        raise errors.NotUnit(path, values, expected)
    return values if abs(length - 1) < 1e-15 else floats(value / length for value in values)
