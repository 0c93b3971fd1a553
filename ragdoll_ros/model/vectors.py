"""Vectors and quaternions as plain tuples of floats: hashable, comparable, exact."""
from __future__ import annotations

import math

from . import errors

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


def floats(values: object) -> tuple[float, ...]:
    """Turn any sequence of numbers into a tuple of floats: hashable, comparable, exact."""
    return tuple(float(value) for value in values)


def finite(path: str, values: object, count: int = 3) -> tuple[float, ...]:
    """``count`` floats; WrongForm where that is not what is given, NotFinite for NaN, infinity."""
    try:
        found = floats(values)
    except (TypeError, ValueError):
        found = ()
    if len(found) != count:
        raise errors.WrongForm(path, values, f'{count} numbers')
    errors.check_finite(path, found)
    return found


def unit(path: str, values: object, expected: str = 'a direction, not zero',
         count: int = 3) -> tuple[float, ...]:
    """``count`` numbers scaled to length one; NotUnit for zero, else as finite()."""
    values = finite(path, values, count)
    length = math.hypot(*values)
    if length < 1e-9:
        raise errors.NotUnit(path, values, expected)
    return values if abs(length - 1) < 1e-15 else floats(value / length for value in values)
