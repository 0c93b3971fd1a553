"""Sine and cosine that are the same bits by any C library.

From them scenes are placed, and a scene that begins a bit aside goes another way. Those of a C
library may be off in the last bit, on one processor otherwise than on the next.
"""
from __future__ import annotations

import math
from decimal import Context, Decimal, localcontext

TURN = Decimal('6.2831853071795864769252867665590057683943387987502')

EXACT = Context(prec=50)

MANY = 1e6


def sine_and_cosine(angle: float) -> tuple[float, float]:
    """Of a finite angle in rad, rounded once: Taylor's series to 35 digits.

    One of more than MANY turns is first taken modulo a turn in float64.
    """
    if abs(angle) > MANY * math.tau:
        angle = math.fmod(angle, math.tau)
    with localcontext(EXACT):
        x, sums, term = Decimal(float(angle)) % TURN, [Decimal(0), Decimal(0)], Decimal(1)
        for k in range(64):
            sums[k % 2] += -term if k & 2 else term
            term *= x / (k + 1)
    cosine, sine = map(float, sums)
    return sine, cosine
