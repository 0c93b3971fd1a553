"""Once through all contacts of an island, one after the other (Gauss-Seidel).

Of non-smooth contact dynamics (Moreau 1988; Jean, CMAME 177, 1999).
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..system import STICKS
from .one_contact import on_disc, one_contact

LIMIT, TOUCH, ROLLING = 1, 3, 5
"""Kinds of contact: how many rows each has."""


@compiled
def sweep(kinds: np.ndarray, rows: np.ndarray, mu: np.ndarray, roll: np.ndarray, m: int, n: int,
          W: np.ndarray, b: np.ndarray, p: np.ndarray) -> float:
    """Go once through m contacts; the largest change of a velocity, m/s or rad/s."""
    worst = 0.0
    for c in range(m):
        a = rows[c]
        at = a * n
        if kinds[c] == LIMIT:
            u = b[a]
            for j in range(n):
                u += W[at + j] * p[j]
            own = W[at + a]
            x = max(0.0, p[a] - u / own)
            worst = max(worst, abs(x - p[a]) * own)
            p[a] = x
            continue
        c0, c1, c2 = b[a], b[a + 1], b[a + 2]
        for j in range(n):
            c0 += W[at + j] * p[j]
            c1 += W[at + n + j] * p[j]
            c2 += W[at + 2 * n + j] * p[j]
        x, y, z = p[a], p[a + 1], p[a + 2]
        sticks = mu[c] >= STICKS
        if c0 >= 0 and x == 0.0 and y == 0.0 and z == 0.0 and not sticks:
            continue
        d = at + a
        c0 -= W[d] * x + W[d + 1] * y + W[d + 2] * z
        c1 -= W[d + 1] * x + W[d + n + 1] * y + W[d + n + 2] * z
        c2 -= W[d + 2] * x + W[d + n + 2] * y + W[d + 2 * n + 2] * z
        if c0 >= 0 and (x == 0.0 or mu[c] <= 0.0) and not sticks:
            nx, ny, nz = 0.0, 0.0, 0.0
        else:
            nx, ny, nz = one_contact(W, n, a, c0, c1, c2, x, y, z, mu[c])
        worst = max(worst, abs(nx - x) * W[d], abs(ny - y) * W[d + n + 1],
                    abs(nz - z) * W[d + 2 * n + 2])
        p[a], p[a + 1], p[a + 2] = nx, ny, nz
        if kinds[c] == ROLLING:
            worst = max(worst, roll_one(W, n, a + 3, b, p, roll[c] * nx))
    return worst


@compiled
def roll_one(W: np.ndarray, n: int, a: int, b: np.ndarray, p: np.ndarray, most: float) -> float:
    """Rolling impulse, rows a and a + 1, of at most ``most`` N m s; the largest change of rad/s."""
    u, w = b[a], b[a + 1]
    for j in range(n):
        u += W[a * n + j] * p[j]
        w += W[(a + 1) * n + j] * p[j]
    w11, w12, w22 = W[a * n + a], W[a * n + a + 1], W[(a + 1) * n + a + 1]
    rho = 1 / (0.5 * (w11 + w22) + math.sqrt(0.25 * (w11 - w22) ** 2 + w12 * w12))
    x, y = p[a], p[a + 1]
    for _ in range(4):
        dx, dy = p[a] - x, p[a + 1] - y
        nx, ny = on_disc(p[a] - rho * (u + w11 * dx + w12 * dy),
                         p[a + 1] - rho * (w + w12 * dx + w22 * dy), most)
        p[a], p[a + 1] = nx, ny
    return max(abs(p[a] - x) * w11, abs(p[a + 1] - y) * w22)
