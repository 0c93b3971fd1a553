"""Sine, cosine, arc, exponential and inverse hyperbolic sine, of sums, products and roots alone.

Those of a C library differ in the last bit between libraries, and within one between processors,
where it uses fused multiply-add. These are the same bits everywhere.
"""
from __future__ import annotations

import math
from decimal import Decimal, localcontext

import numpy as np

from ..compiling.decorators import compiled

QUARTER, REST = 1.5707963267341256, 6.077100506506192e-11
"""pi / 2 in two parts; a whole number of up to 2**20 times the first one is not rounded."""

S3, S5, S7, S9, S11, S13, S15, S17 = (
    (-1) ** k / math.factorial(2 * k + 1) for k in range(1, 9))
C4, C6, C8, C10, C12, C14, C16, C18 = ((-1) ** k / math.factorial(2 * k) for k in range(2, 10))
"""Taylor coefficients: within pi / 4 the next ones are below rounding."""


def _node(place: float) -> tuple[float, float, float]:
    """Return angle, sine and cosine of the direction (1 - place, 1 - |1 - place|), 0 <= place < 2,
    rounded correctly, so the same on all machines.
    """
    with localcontext() as context:
        context.prec = 40
        x, y = 1 - Decimal(place), 1 - abs(1 - Decimal(place))
        size = (x * x + y * y).sqrt()
        sin, cos = y / size, x / size
        tangent, share = y / (size + x), 2
        for _ in range(4):
            tangent, share = tangent / (1 + (1 + tangent * tangent).sqrt()), 2 * share
        angle, power = Decimal(0), share * tangent
        for k in range(1, 41, 2):
            angle, power = angle + power / k, -power * tangent * tangent
    return float(angle), float(sin), float(cos)


NODE, NODE_SIN, NODE_COS = np.array([
    (0.0, 0.0, 1.0), *(_node((k + 0.5) / 16) for k in range(1, 32)), (math.pi, 0.0, -1.0)]).T.copy()
"""Angles, rad, with sine and cosine: 0, and of the middles of 31 equal pieces of the way from
(1, 0) by (0, 1) to (-1, 0)."""

LN2 = 0.6931471805599453
LN2_HIGH, LN2_LOW = 0.693147180369123816490, 1.90821492927058770002e-10
"""ln 2, and in two parts; a whole number of up to 2**20 times the first one is not rounded."""


@compiled
def sine_and_cosine(angle: float) -> tuple[float, float]:
    """Return sine and cosine of an angle, rad. Error 3e-16; past a million turns it is that of
    rounding the angle itself.
    """
    if abs(angle) < math.pi / 4:
        return series(angle)
    quarters = math.floor(angle * (2 / math.pi) + 0.5)
    s, c = series((angle - quarters * QUARTER) - quarters * REST)
    quadrant = quarters - 4 * math.floor(quarters / 4)
    if quadrant == 1:
        return c, -s
    if quadrant == 2:
        return -s, -c
    if quadrant == 3:
        return -c, s
    return s, c


@compiled
def series(x: float) -> tuple[float, float]:
    """Sine and cosine of x rad, at most a little more than pi / 4, by Taylor's series."""
    z = x * x
    u = z * z
    s = (S3 + u * (S7 + u * (S11 + u * S15))) + z * (S5 + u * (S9 + u * (S13 + u * S17)))
    c = (C4 + u * (C8 + u * (C12 + u * C16))) + z * (C6 + u * (C10 + u * (C14 + u * C18)))
    return x + x * z * s, 1 - (0.5 * z - u * c)


@compiled
def asinh(x: float) -> float:
    """Return the inverse hyperbolic sine of x: the result is halved until a short series suffices,
    by sinh(a) = 2 sinh(a/2) sqrt(1 + sinh(a/2)^2).
    """
    share = 1.0
    while abs(x) > 0.05:
        x, share = x / math.sqrt(2 + 2 * math.sqrt(1 + x * x)), 2 * share
    z = x * x
    return share * (x - x * z * (1 / 6 - z * (3 / 40 - z * (15 / 336 - z * (
        105 / 3456 - z * (945 / 42240 - z * (10395 / 599040)))))))


@compiled
def arc(sin: float, cos: float) -> float:
    """Angle, rad in [0, pi], whose sine and cosine are in this proportion; ``sin`` >= 0, not both
    0. It is that of a node nearby, and the arc tangent of the rest, at most 0.07.
    """
    past_right = sin / (sin + abs(cos)) if cos > 0 else 2 - sin / (sin - cos)
    node = int(past_right * 16) if past_right >= 0 else 0  # not of NaN
    rest = ((sin * NODE_COS[node] - cos * NODE_SIN[node])
            / (cos * NODE_COS[node] + sin * NODE_SIN[node]))
    z = rest * rest
    u = z * z
    series = (1 / 3 - z / 5) + u * ((1 / 7 - z / 9) + u * (1 / 11 - z / 13))
    return NODE[node] + (rest - rest * z * series)


@compiled
def exp_minus(x: float) -> tuple[float, float]:
    """e^x and e^x - 1 of a number x <= 0; error of both 2e-16 of the value."""
    if x < -745:
        return 0.0, -1.0
    doublings = math.floor(x * (1 / LN2) + 0.5)
    rest = (x - doublings * LN2_HIGH) - doublings * LN2_LOW
    total = 1.0
    for k in range(13, 1, -1):
        total = 1 + total * rest / k
    small = rest * total
    value = math.ldexp(1 + small, int(doublings))
    return value, small if doublings == 0 else value - 1
