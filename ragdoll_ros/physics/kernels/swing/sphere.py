"""Logarithm and exponential map of the unit sphere."""
from __future__ import annotations

import math

from ..compiling.decorators import compiled
from ..maths.transcendental import arc, sine_and_cosine
from ..maths.vectors import Vec3, add, add_scaled, dot, scale

SMALLEST = 1e-150
"""Avoids 0/0; vanishes in rounding beside any other length."""


@compiled
def log_map(d: Vec3, target: Vec3) -> Vec3:
    """Logarithm map: the tangent, rad, at ``d`` that points to ``target``, as long as the arc.

    Zero for the antipode, where it is not defined.
    """
    cos = dot(d, target)
    across = add_scaled(target, -cos, d)
    sin = math.sqrt(dot(across, across))
    return scale(arc(sin, cos) / (sin + SMALLEST), across)


@compiled
def exp_map(d: Vec3, x: Vec3) -> tuple[Vec3, Vec3]:
    """Exponential map of a tangent ``x`` at ``d``: the new direction, of unit length to rounding,
    and the chord of transported(), (d + end) scaled so that transport takes (x v) chord off v.
    """
    half = math.sqrt(dot(x, x)) / 2 + SMALLEST
    sin, cos = sine_and_cosine(half)
    ratio = sin / (cos * half)
    end = add(scale(cos * cos - sin * sin, d), scale(sin * cos / half, x))
    end = scale(1 / math.sqrt(dot(end, end)), end)
    return end, scale(ratio / 2, add(d, end))


@compiled
def transported(v: Vec3, x: Vec3, chord: Vec3) -> Vec3:
    """Parallel transport of a tangent ``v`` at d along the geodesic of exp_map(d, x), whose second
    return value is ``chord``.
    """
    return add_scaled(v, -dot(x, v), chord)
