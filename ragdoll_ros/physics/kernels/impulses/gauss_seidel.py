"""Once through all contacts of an island, one after the other (Gauss-Seidel).

Of non-smooth contact dynamics (Moreau 1988; Jean, CMAME 177, 1999).
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..system import NO_SLIP
from .one_contact import project_to_disc, solve_one_contact

LIMIT, TOUCH, ROLLING = 1, 3, 5
"""Kinds of contact: how many rows each has."""


@compiled
def velocities(W: np.ndarray, b: np.ndarray, p: np.ndarray, n: int, u: np.ndarray) -> None:
    """Let u be W p + b, column by column, which a processor does several rows of at once."""
    for i in range(n):
        u[i] = b[i]
    for j in range(n):
        add_column(W, n, j, p[j], u)


@compiled
def add_column(W: np.ndarray, n: int, j: int, change: float, u: np.ndarray) -> None:
    """What a change of the impulse of row j does to all velocities u (n,)."""
    if change != 0.0:
        own = W[j * n:j * n + n]
        for i in range(n):
            u[i] += own[i] * change


@compiled
def gauss_seidel_sweep(kinds: np.ndarray, rows: np.ndarray, mu: np.ndarray, roll: np.ndarray, m: int, n: int,
          W: np.ndarray, b: np.ndarray, p: np.ndarray, u: np.ndarray) -> float:
    """Go once through m contacts; the largest change of a velocity, m/s or rad/s. u (n,): room."""
    worst = 0.0
    velocities(W, b, p, n, u)
    for c in range(m):
        a = rows[c]
        d = a * n + a
        if kinds[c] == LIMIT:
            x = max(0.0, p[a] - u[a] / W[d])
            worst = max(worst, abs(x - p[a]) * W[d])
            add_column(W, n, a, x - p[a], u)
            p[a] = x
            continue
        x, y, z = p[a], p[a + 1], p[a + 2]
        sticks = mu[c] >= NO_SLIP
        if u[a] >= 0 and x == 0.0 and y == 0.0 and z == 0.0 and not sticks:
            continue
        c0 = u[a] - (W[d] * x + W[d + 1] * y + W[d + 2] * z)
        c1 = u[a + 1] - (W[d + 1] * x + W[d + n + 1] * y + W[d + n + 2] * z)
        c2 = u[a + 2] - (W[d + 2] * x + W[d + n + 2] * y + W[d + 2 * n + 2] * z)
        if c0 >= 0 and (x == 0.0 or mu[c] <= 0.0) and not sticks:
            nx, ny, nz = 0.0, 0.0, 0.0
        else:
            nx, ny, nz = solve_one_contact(W, n, a, c0, c1, c2, x, y, z, mu[c])
        worst = max(worst, abs(nx - x) * W[d], abs(ny - y) * W[d + n + 1],
                    abs(nz - z) * W[d + 2 * n + 2])
        p[a], p[a + 1], p[a + 2] = nx, ny, nz
        add_column(W, n, a, nx - x, u)
        add_column(W, n, a + 1, ny - y, u)
        add_column(W, n, a + 2, nz - z, u)
        if kinds[c] == ROLLING:
            worst = max(worst, solve_rolling(W, n, a + 3, p, u, roll[c] * nx))
    return worst


@compiled
def solve_rolling(W: np.ndarray, n: int, a: int, p: np.ndarray, u: np.ndarray, most: float) -> float:
    """Rolling impulse, rows a and a + 1, of at most ``most`` N m s; the largest change of rad/s."""
    w11, w12, w22 = W[a * n + a], W[a * n + a + 1], W[(a + 1) * n + a + 1]
    rho = 1 / (0.5 * (w11 + w22) + math.sqrt(0.25 * (w11 - w22) ** 2 + w12 * w12))
    x, y = p[a], p[a + 1]
    for _ in range(4):
        dx, dy = p[a] - x, p[a + 1] - y
        nx, ny = project_to_disc(p[a] - rho * (u[a] + w11 * dx + w12 * dy),
                         p[a + 1] - rho * (u[a + 1] + w12 * dx + w22 * dy), most)
        p[a], p[a + 1] = nx, ny
    dx, dy = p[a] - x, p[a + 1] - y
    add_column(W, n, a, dx, u)
    add_column(W, n, a + 1, dy, u)
    return max(abs(dx) * w11, abs(dy) * w22)
