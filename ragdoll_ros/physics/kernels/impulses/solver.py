"""Impulses of an island of contacts and limits, by Signorini's and Coulomb's laws exactly.

Unknown are the impulses p, rows of 1 (a limit), 3 (a contact: normal, two along the surface) or 5
(the same and two of rolling). The velocities after are u = W p + b. Wanted:
u_n >= 0, p_n >= 0, u_n p_n = 0; |p_t| <= mu p_n, and where u_t is not zero p_t = -mu p_n u_t/|u_t|.

Without friction, or where it has no limit, an active set solves it. Else sweeps come near; where
they stall, as with mass ratios of 1:1000, Newton's method ends it.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..system import NO_SLIP
from .active_set import is_convex, solve_active_set
from .newton import newton
from .one_contact import project_to_disc
from .gauss_seidel import LIMIT, gauss_seidel_sweep

ROUNDS, LOOSER = 6, 3
"""Of sweeps, twice as many as in the round before, and of Newton's method, against ten times as
much; the first LOOSER that come to no end make do with ten times the tolerance."""

RESIST = 1e-5
"""Share of its own W by which an impulse resists the first round's steps: enough for what is known
to 1e-8 of W, the compliance, and far less than what decides what bodies do."""

OPENING = 1e-4
"""m/s from which a contact without friction's limit is let go as open."""


@compiled
def project_to_cones(kinds: np.ndarray, rows: np.ndarray, mu: np.ndarray, roll: np.ndarray, m: int,
               p: np.ndarray) -> None:
    """Bring all impulses into their cones: no contact ever pulls."""
    for c in range(m):
        a = rows[c]
        p[a] = max(0.0, p[a])
        for k in range(1, kinds[c], 2):
            if k == 1 and mu[c] >= NO_SLIP:
                continue
            most = p[a] * max(0.0, mu[c] if k == 1 else roll[c])
            p[a + k], p[a + k + 1] = project_to_disc(p[a + k], p[a + k + 1], most)


@compiled
def solve_cones(kinds: np.ndarray, rows: np.ndarray, mu: np.ndarray, roll: np.ndarray, m: int,
                n: int, W: np.ndarray, b: np.ndarray, p: np.ndarray, tolerance: float,
                sweeps: int, room: np.ndarray, G: np.ndarray) -> tuple[float, int]:
    """Solve for p (n,), from where it stands; the largest residual left, m/s, and the sweeps."""
    done, left, resist = 0, math.inf, RESIST
    convex = is_convex(kinds, mu, roll, m)
    if convex:
        sweeps = 1
    for turn in range(ROUNDS):
        for _ in range(sweeps):
            done += 1
            worst = gauss_seidel_sweep(kinds, rows, mu, roll, m, n, W, b, p, room[0])
            if worst <= tolerance:
                return worst, done
        if convex and solve_active_set(kinds, rows, mu, m, n, W, b, p, tolerance, room, G):
            return tolerance, done
        left = newton(kinds, rows, mu, roll, m, n, W, b, p, tolerance, resist, room, G)
        project_to_cones(kinds, rows, mu, roll, m, p)
        if turn < LOOSER:
            tolerance *= 10
        if left <= tolerance:
            return left, done
        sweeps, resist = 2 * sweeps, 10 * resist
    return left, done


@compiled
def is_opening(W: np.ndarray, n: int, a: int, b: np.ndarray, p: np.ndarray) -> bool:
    """Whether a contact comes apart."""
    u = b[a]
    for j in range(n):
        u += W[a * n + j] * p[j]
    return u > OPENING


@compiled
def solve_island_impulses(kinds: np.ndarray, rows: np.ndarray, mu: np.ndarray, roll: np.ndarray, m: int,
                   n: int, W: np.ndarray, b: np.ndarray, p: np.ndarray, tolerance: float,
                   sweeps: int, room: np.ndarray, G: np.ndarray) -> tuple[float, int]:
    """Solve for p (n,), from where it stands; the largest residual left, m/s, and the sweeps.

    Friction without limit makes a convex problem of it, which holds a contact sideways even as it
    opens; so what has come out as open is let go, and all is solved once more. What then closes
    after all is held: between the two there is no answer (Painleve).
    """
    left, done = solve_cones(kinds, rows, mu, roll, m, n, W, b, p, tolerance, sweeps, room, G)
    for turn in range(2):
        some = False
        for c in range(m):
            a = rows[c]
            if kinds[c] == LIMIT:
                continue
            if turn == 0 and mu[c] >= NO_SLIP and p[a] <= 0.0 and (
                    p[a + 1] != 0.0 or p[a + 2] != 0.0) and is_opening(W, n, a, b, p):
                mu[c] = -1.0
                p[a] = p[a + 1] = p[a + 2] = 0.0
                some = True
            elif turn == 1 and mu[c] < 0 and p[a] > 0:
                mu[c] = NO_SLIP
                some = True
        if not some:
            break
        left, more = solve_cones(kinds, rows, mu, roll, m, n, W, b, p, tolerance, sweeps, room, G)
        done += more
    return left, done


@compiled
def solve_normals(kinds: np.ndarray, rows: np.ndarray, mu: np.ndarray, roll: np.ndarray, m: int,
                  n: int, W: np.ndarray, need: np.ndarray, p: np.ndarray, room: np.ndarray,
                  G: np.ndarray) -> None:
    """Least normal impulses p (n,) that give each contact its velocity need[0] (m,) or more, but
    for a compliance of need[2], as a share of its W.

    W, kinds and rows are lost: the normals' own W takes their place.
    """
    b, own = room[4], room[5]
    for c in range(m):
        for e in range(m):
            W[c * m + e] = W[rows[c] * n + rows[e]]
    for i in range(n):
        p[i] = 0.0
    for c in range(m):
        W[c * m + c] *= 1 + need[2, c]
        b[c], own[c], room[6, c] = -need[0, c], 0.0, rows[c]
        kinds[c], rows[c], mu[c], roll[c] = LIMIT, c, 0.0, 0.0
    solve_cones(kinds, rows, mu, roll, m, m, W, b, own, 1e-9, 4, room, G)
    for c in range(m):
        p[int(room[6, c])] = max(0.0, own[c])


@compiled
def scale_to_no_work(p: np.ndarray, n: int, work: float, spent: float) -> None:
    """Scale impulses p (n,) whose energy is ``work`` + ``spent`` / 2, J, so that it is none; what
    is no number becomes none.
    """
    share = min(1.0, max(0.0, -2 * work / spent)) if spent > 0 else 0.0
    if not math.isfinite(share) or not math.isfinite(work):
        share = 0.0
    for i in range(n):
        p[i] = share * p[i] if share > 0 else 0.0
