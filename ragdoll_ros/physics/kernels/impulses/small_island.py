"""A small island: what its contacts answer, by W = Y Y^T, as exactly as numbers allow."""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..maths.cholesky import factor_row, substitute
from ..system import COMPLIANCE, IMPACT_COMPLIANCE, Workspace
from .solver import solve_island_impulses, solve_normals, scale_to_no_work

SWEEPS = 8
"""Sweeps before Newton's method is asked for the first time."""

UNSOLVED = 1e-5
"""m/s: what is left by more is counted, and its impulses are kept from making energy."""

LOCKED = 1e-13
"""Share of the largest ease, W, of an island's rows up to which one is locked."""

NO_MOTION = 1e-4
"""Share of W's diagonal up to which no motion of the bodies is what rows see of a curved way."""

STRAIGHT = 1e-11
"""m/s or rad/s: of a way that is less curved, nobody asks whether it is a motion."""


@compiled
def solve_small(r: Workspace, count: int, n: int, h: float, tolerance: float, thrown: bool,
                deep: bool) -> None:
    """Solve an island of n rows over h s, or at an impact, h = 0, for its impulses, r.p[1], and, if
    something is ``deep``, for those that give depths back, r.p[2]. ``thrown``: r.p[0] asks for
    restitution, which may make energy.
    """
    b, p, start, soft = r.p[0], r.p[1], r.p[3], r.p[4]
    form_matrix(r, count, n, COMPLIANCE if h > 0 else IMPACT_COMPLIANCE)
    if h > 0:
        add_curvature_bias(r, count, n)
    mask_singular_rows(r.W, n, b)
    left, turns = solve_island_impulses(r.kinds, r.rows, r.mu, r.roll, count, n, r.W, b, p, tolerance,
                                 SWEEPS, r.solver, r.G)
    if thrown and energy_gain(r.W, start, p, n) > 0:
        for j in range(n):
            soft[j] = p[j]
        solve_island_impulses(r.kinds, r.rows, r.mu, r.roll, count, n, r.W, start, soft, tolerance, SWEEPS,
                       r.solver, r.G)
        if energy_gain(r.W, start, soft, n) > 0:
            scale_to_energy_bound(r.W, start, soft, n)
        bound_energy(r.W, start, soft, p, n)
        r.stats[0].restitution_reduced += 1
    r.stats[0].sweeps += turns
    if not left <= UNSOLVED:
        r.stats[0].unsolved += 1
        scale_to_energy_bound(r.W, start, p, n)
    if deep:
        solve_normals(r.kinds, r.rows, r.mu, r.roll, count, n, r.W, r.need, r.p[2], r.solver, r.G)


@compiled
def form_matrix(r: Workspace, count: int, n: int, compliance: float) -> None:
    """W = Y Y^T, flat (n * n), its diagonal with the compliance; row by row of Y^T, which a
    processor does several columns of at once.
    """
    Y, W, YT = r.Y, r.W, r.YT
    for x in range(len(YT)):
        for e in range(n):
            YT[x, e] = 0.0
    for k in range(count):
        i = int(r.need[1, k])
        for e in range(r.rows[k], r.rows[k] + r.kinds[k]):
            for x in range(r.contacts[i].dof_count):
                YT[r.support[i, x], e] = Y[e, x]
    for k in range(count):
        i = int(r.need[1, k])
        for e in range(r.rows[k], r.rows[k] + r.kinds[k]):
            own = W[e * n:e * n + e + 1]
            for f in range(e + 1):
                own[f] = 0.0
            support, x = r.contacts[i].dof_count, 0
            while x + 4 <= support:
                at = r.support[i]
                a, b, c, d = YT[at[x]], YT[at[x + 1]], YT[at[x + 2]], YT[at[x + 3]]
                p, q, s, t = Y[e, x], Y[e, x + 1], Y[e, x + 2], Y[e, x + 3]
                for f in range(e + 1):
                    own[f] = own[f] + p * a[f] + q * b[f] + s * c[f] + t * d[f]
                x += 4
            while x < support:
                p, a = Y[e, x], YT[r.support[i, x]]
                for f in range(e + 1):
                    own[f] += p * a[f]
                x += 1
            for f in range(e):
                W[f * n + e] = own[f]
            own[e] *= 1 + compliance


@compiled
def add_curvature_bias(r: Workspace, count: int, n: int) -> None:
    """Add to r.p[0] what rows see of a curved way, r.p[4], as far as it is a motion of the bodies:
    the points of a patch that turns see more than any motion could answer. What opens sees its own.

    That motion is W x, where (W + R) x is what they see, and R a little of W's diagonal.
    """
    W, G, curve, b, x = r.W, r.G, r.p[4], r.p[0], r.p[2]
    most = size = 0.0
    for i in range(n):
        size = max(size, abs(curve[i]))
        most = max(most, W[i * n + i])
    if size <= STRAIGHT:
        for i in range(n):
            b[i] += curve[i]
        return
    for i in range(n):
        x[i] = curve[i]
        for j in range(n):
            G[i * n + j] = W[i * n + j]
        G[i * n + i] += NO_MOTION * W[i * n + i] + LOCKED * most
    for k in range(count):
        if r.need[3, k] > 0:
            for i in range(r.rows[k], r.rows[k] + r.kinds[k]):
                for j in range(n):
                    G[i * n + j] = G[j * n + i] = 0.0
                G[i * n + i], x[i] = 1.0, 0.0
    for i in range(n):
        factor_row(G, n, i, n)
    substitute(G, n, n, x)
    for i in range(n):
        b[i] += curve[i] - (NO_MOTION * W[i * n + i] + LOCKED * most) * x[i]


@compiled
def mask_singular_rows(W: np.ndarray, n: int, b: np.ndarray) -> None:
    """Let rows ask for nothing along which nothing can move, as no joint lets it: W is zero there,
    and would be divided by.
    """
    most = 0.0
    for i in range(n):
        most = max(most, W[i * n + i])
    for i in range(n):
        if W[i * n + i] <= LOCKED * most:
            for j in range(n):
                W[i * n + j] = W[j * n + i] = 0.0
            W[i * n + i] = most if most > 0 else 1.0
            b[i] = 0.0


@compiled
def energy_gain(W: np.ndarray, u: np.ndarray, p: np.ndarray, n: int) -> float:
    """Kinetic energy, J, that impulses p give to what moves at u: p (u + W p / 2); 0 if that is
    rounding.
    """
    total = size = 0.0
    for i in range(n):
        w = 0.0
        for j in range(n):
            w += W[i * n + j] * p[j]
        total += p[i] * (u[i] + w / 2)
        size += abs(p[i] * u[i])
    return total if total > 1e-12 * size else 0.0


@compiled
def scale_to_energy_bound(W: np.ndarray, u: np.ndarray, p: np.ndarray, n: int) -> None:
    """Scale impulses that are no solution so that they make no energy."""
    work = spent = 0.0
    for i in range(n):
        w = 0.0
        for j in range(n):
            w += W[i * n + j] * p[j]
        work += p[i] * u[i]
        spent += p[i] * w
    scale_to_no_work(p, n, work, spent)


@compiled
def bound_energy(W: np.ndarray, u: np.ndarray, soft: np.ndarray, p: np.ndarray, n: int) -> None:
    """Draw p towards the ``soft`` impulses, those of no restitution, until no energy is made.

    Newton's law with friction can make some (Kane and Levinson 1985). Soft impulses never do:
    p u+ <= 0 and so p (u + W p / 2) = p u+ - p W p / 2 < 0; between both, all are within their
    cones and press nothing into anything, as cones and half-spaces are convex.
    """
    a = b = 0.0
    for i in range(n):
        w = ws = 0.0
        for j in range(n):
            w += W[i * n + j] * (p[j] - soft[j])
            ws += W[i * n + j] * soft[j]
        a += (p[i] - soft[i]) * w / 2
        b += (p[i] - soft[i]) * (u[i] + ws)
    c = min(0.0, energy_gain(W, u, soft, n))
    root = math.sqrt(max(0.0, b * b - 4 * a * c))
    share = (-2 * c / (b + root) if b > 0 else (root - b) / (2 * a)) if a > 0 else 1.0
    share = min(1.0, max(0.0, share))
    for i in range(n):
        p[i] = soft[i] + share * (p[i] - soft[i])
