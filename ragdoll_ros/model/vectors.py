"""Vectors and quaternions as plain tuples of floats: hashable, comparable, exact."""
import math
from collections.abc import Iterable, Sequence

from . import errors

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


def floats(values: Iterable[float]) -> tuple[float, ...]:
    """A tuple of floats."""
    return tuple(float(value) for value in values)


def vector(values: Iterable[float]) -> Vector:
    """A tuple of three floats."""
    x, y, z = map(float, values)
    return x, y, z


def finite_floats(path: str, values: object, count: int = 3) -> tuple[float, ...]:
    """``count`` finite floats. Raises WrongForm, NotFinite."""
    try:
        found = floats(values)
    except (TypeError, ValueError):
        found = ()
    if len(found) != count:
        raise errors.WrongForm(path, values, f'{count} numbers')
    errors.check_finite(path, found)
    return found


def unit_vector(path: str, values: object, expected: str = 'a direction, not zero',
                count: int = 3) -> tuple[float, ...]:
    """``count`` floats scaled to length one. Raises NotUnit for zero, WrongForm, NotFinite."""
    values = finite_floats(path, values, count)
    length = math.hypot(*values)
    if length < 1e-9:
        raise errors.NotUnit(path, values, expected)
    return values if abs(length - 1) < 1e-15 else floats(value / length for value in values)


def clamp_norm(values: Sequence[float], most: float) -> tuple[Vector, float]:
    """A finite vector scaled to a norm of at most ``most``, and its norm before.

    It is first divided by its largest component, so that nothing overflows.
    """
    largest = max(map(abs, values))
    if largest == 0:
        return (0.0, 0.0, 0.0), 0.0
    direction = [value / largest for value in values]
    spread = math.hypot(*direction)
    length = largest * spread
    if length <= most:
        return tuple(values), length
    return tuple(value * (most / spread) for value in direction), length
