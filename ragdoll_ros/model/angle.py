"""Correctly rounded sine and cosine: the same bits with every C library and processor.

Initial states are computed with them, so that simulations agree to the bit across machines.
"""
from __future__ import annotations

import math
from decimal import Context, Decimal, localcontext

TWO_PI = Decimal('6.2831853071795864769252867665590057683943387987502')

DIGITS_50 = Context(prec=50)

LARGE_TURNS = 1e6


def sine_and_cosine(angle: float) -> tuple[float, float]:
    """Sine and cosine of a finite angle in rad, by the Taylor series in 50 digits, rounded once.

    An angle above LARGE_TURNS is first reduced modulo a turn in float64.
    """
    if abs(angle) > LARGE_TURNS * math.tau:
        angle = math.fmod(angle, math.tau)
    with localcontext(DIGITS_50):
        x, sums, term = Decimal(float(angle)) % TWO_PI, [Decimal(0), Decimal(0)], Decimal(1)
        for k in range(64):
            sums[k % 2] += -term if k & 2 else term
            term *= x / (k + 1)
    cosine, sine = map(float, sums)
    return sine, cosine
