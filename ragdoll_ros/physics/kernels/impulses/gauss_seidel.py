"""One Gauss-Seidel sweep over the contacts of a small island, by its W; symbols as in solver.py.

Non-smooth contact dynamics (Moreau 1988; Jean, CMAME 177, 1999).
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..contact_kind import LIMIT, ROLLING
from ..system import NO_SLIP
from .one_contact import project_to_disc, solve_one_contact


@compiled
def velocities(W: np.ndarray, b: np.ndarray, p: np.ndarray, n: int, u: np.ndarray) -> None:
    """Write W p + b to u (n,), column by column, for vector instructions."""
    for i in range(n):
        u[i] = b[i]
    for j in range(n):
        add_velocity_change(W, n, j, p[j], u)


@compiled
def add_velocity_change(W: np.ndarray, n: int, j: int, change: float, u: np.ndarray) -> None:
    """Add to the velocities u (n,) the effect of a ``change`` of the impulse of row j."""
    if change != 0.0:
        own = W[j * n:j * n + n]
        for i in range(n):
            u[i] += own[i] * change


@compiled
def gauss_seidel_sweep(members: np.ndarray, m: int, n: int, W: np.ndarray, b: np.ndarray,
                       p: np.ndarray, u: np.ndarray) -> float:
    """Do one projected Gauss-Seidel sweep: solve each of m contacts in turn for its impulses, in
    place in p (n,). Returns the largest change of a row's velocity by its own impulse, m/s or
    rad/s. u (n,) becomes W p + b with the new p.
    """
    worst = 0.0
    velocities(W, b, p, n, u)
    for k in range(m):
        member = members[k]
        a, mu = member.row, member.friction
        d = a * n + a
        if member.kind == LIMIT:
            x = max(0.0, p[a] - u[a] / W[d])
            worst = max(worst, abs(x - p[a]) * W[d])
            add_velocity_change(W, n, a, x - p[a], u)
            p[a] = x
            continue
        x, y, z = p[a], p[a + 1], p[a + 2]
        if u[a] >= 0 and x == 0.0 and y == 0.0 and z == 0.0 and mu < NO_SLIP:
            continue
        c = (u[a] - (W[d] * x + W[d + 1] * y + W[d + 2] * z),
             u[a + 1] - (W[d + 1] * x + W[d + n + 1] * y + W[d + n + 2] * z),
             u[a + 2] - (W[d + 2] * x + W[d + n + 2] * y + W[d + 2 * n + 2] * z))
        if c[0] >= 0 and (x == 0.0 or mu <= 0.0) and mu < NO_SLIP:
            nx, ny, nz = 0.0, 0.0, 0.0
        else:
            nx, ny, nz = solve_one_contact(W, n, a, c, (x, y, z), mu)
        worst = max(worst, abs(nx - x) * W[d], abs(ny - y) * W[d + n + 1],
                    abs(nz - z) * W[d + 2 * n + 2])
        p[a], p[a + 1], p[a + 2] = nx, ny, nz
        add_velocity_change(W, n, a, nx - x, u)
        add_velocity_change(W, n, a + 1, ny - y, u)
        add_velocity_change(W, n, a + 2, nz - z, u)
        if member.kind == ROLLING:
            worst = max(worst, solve_rolling(W, n, a + 3, p, u, member.rolling_friction * nx))
    return worst


@compiled
def solve_rolling(W: np.ndarray, n: int, a: int, p: np.ndarray, u: np.ndarray,
                  most: float) -> float:
    """Improve the rolling impulse of rows a and a + 1, at most ``most`` N m s, by four projected
    gradient steps; p and u follow.
    Returns the largest change of an angular velocity, rad/s.
    """
    w11, w12, w22 = W[a * n + a], W[a * n + a + 1], W[(a + 1) * n + a + 1]
    rho = 1 / (0.5 * (w11 + w22) + math.sqrt(0.25 * (w11 - w22) ** 2 + w12 * w12))
    x, y = p[a], p[a + 1]
    for _ in range(4):
        dx, dy = p[a] - x, p[a + 1] - y
        nx, ny = project_to_disc(p[a] - rho * (u[a] + w11 * dx + w12 * dy),
                                 p[a + 1] - rho * (u[a + 1] + w12 * dx + w22 * dy), most)
        p[a], p[a + 1] = nx, ny
    dx, dy = p[a] - x, p[a + 1] - y
    add_velocity_change(W, n, a, dx, u)
    add_velocity_change(W, n, a + 1, dy, u)
    return max(abs(dx) * w11, abs(dy) * w22)
