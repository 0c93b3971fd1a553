"""A small island: its contacts by W = Y Y^T, the Delassus operator."""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled
from ..maths.cholesky import factor_row, substitute
from ..system import COMPLIANCE, IMPACT_COMPLIANCE
from ..workspace import Island, Workspace
from .solver import (UNSOLVABLE, RESTITUTION_ROUNDS, ROUNDS, UNSOLVED, energy_bound_share,
                     scale_to_no_work, solve_impulses, solve_position_correction)

SINGULAR = 1e-13
"""Share of the largest diagonal entry of W up to which a row counts as immovable."""

CURVATURE_COMPLIANCE = 1e-4
"""Share of W's diagonal up to which a curvature bias is no motion of the bodies."""

STRAIGHT = 1e-11
"""m/s or rad/s: a smaller curvature bias is added unfiltered."""


@compiled
def solve_small(ws: Workspace, m: int, n: int, h: float, tolerance: float, has_restitution: bool,
                has_penetration: bool) -> None:
    """Solve an island of m contacts and n rows over h s, or at an impact, h = 0, for
    island.impulses; if ``has_penetration`` (a member has a ``correction``), also for
    island.correction. After assemble_rhs(). ``tolerance``: residual, m/s. ``has_restitution``: the
    right-hand side contains restitution. If restitution adds energy, bound_energy() reduces it; if
    a step (h > 0) has no solution with restitution, it is left out.
    """
    island, b, p, u, soft = (ws.island, ws.island.rhs, ws.island.impulses, ws.island.free_velocity,
                             ws.island.soft)
    form_contact_matrix(ws, m, n, COMPLIANCE if h > 0 else IMPACT_COMPLIANCE)
    if h > 0:
        add_curvature_bias(island, m, n)
    mask_singular_rows(island.W, n, b)
    rounds = RESTITUTION_ROUNDS if has_restitution and h > 0 else ROUNDS
    left, sweeps = solve_impulses(island, m, n, b, p, tolerance, rounds)
    failed = rounds < ROUNDS and not left <= UNSOLVABLE
    if failed or (has_restitution and energy_gain(island.W, u, p, n) > 0):
        for j in range(n):
            soft[j] = 0.0 if failed else p[j]
        soft_left, more = solve_impulses(island, m, n, u, soft, tolerance, ROUNDS)
        sweeps += more
        if energy_gain(island.W, u, soft, n) > 0:
            scale_to_energy_bound(island.W, u, soft, n)
        if failed:
            left = soft_left
            for j in range(n):
                p[j] = soft[j]
        else:
            bound_energy(island.W, u, soft, p, n)
        ws.stats[0].restitution_reduced += 1
    ws.stats[0].sweeps += sweeps
    if not left <= UNSOLVED:
        ws.stats[0].unsolved += 1
    if h == 0.0 or not left <= UNSOLVED:
        scale_to_energy_bound(island.W, u, p, n)
    if has_penetration:
        solve_position_correction(island, m, n)


@compiled
def form_contact_matrix(ws: Workspace, m: int, n: int, compliance: float) -> None:
    """Write W = Y Y^T to island.W, flat (n * n), its diagonal times 1 + ``compliance``; row by row
    of Y^T, for vector instructions.
    """
    island = ws.island
    Y, W, YT, members = island.Y, island.W, island.YT, island.members
    for x in range(len(YT)):
        for e in range(n):
            YT[x, e] = 0.0
    for k in range(m):
        i = members[k].contact
        for e in range(members[k].row, members[k].row + members[k].kind):
            for x in range(ws.contacts.found[i].dof_count):
                YT[island.support[i, x], e] = Y[e, x]
    for k in range(m):
        i = members[k].contact
        dofs, support = ws.contacts.found[i].dof_count, island.support[i]
        for e in range(members[k].row, members[k].row + members[k].kind):
            own = W[e * n:e * n + e + 1]
            for f in range(e + 1):
                own[f] = 0.0
            x = 0
            while x + 4 <= dofs:
                a, b, c, d = (YT[support[x]], YT[support[x + 1]], YT[support[x + 2]],
                              YT[support[x + 3]])
                p, q, s, t = Y[e, x], Y[e, x + 1], Y[e, x + 2], Y[e, x + 3]
                for f in range(e + 1):
                    own[f] = own[f] + p * a[f] + q * b[f] + s * c[f] + t * d[f]
                x += 4
            while x < dofs:
                p, a = Y[e, x], YT[support[x]]
                for f in range(e + 1):
                    own[f] += p * a[f]
                x += 1
            for f in range(e):
                W[f * n + e] = own[f]
            own[e] *= 1 + compliance


@compiled
def add_curvature_bias(island: Island, m: int, n: int) -> None:
    """Add the curvature bias to island.rhs, filtered to what motions of the bodies can produce: in
    a patch that turns, the whole bias is more than any impulses can answer. Contacts that separate
    get their whole bias. If no entry exceeds STRAIGHT in size, nothing is filtered.

    The filtered bias is W x, where (W + R) x is the bias and R a small share of W's diagonal.
    Overwrites island.G and island.correction.
    """
    W, G, curve, b, x = island.W, island.G, island.curvature, island.rhs, island.correction
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
        G[i * n + i] += CURVATURE_COMPLIANCE * W[i * n + i] + SINGULAR * most
    for k in range(m):
        member = island.members[k]
        if member.separating:
            for i in range(member.row, member.row + member.kind):
                for j in range(n):
                    G[i * n + j] = G[j * n + i] = 0.0
                G[i * n + i], x[i] = 1.0, 0.0
    for i in range(n):
        factor_row(G, n, i, n)
    substitute(G, n, n, x)
    for i in range(n):
        b[i] += curve[i] - (CURVATURE_COMPLIANCE * W[i * n + i] + SINGULAR * most) * x[i]


@compiled
def mask_singular_rows(W: np.ndarray, n: int, b: np.ndarray) -> None:
    """Decouple rows in which joints let no body move: their diagonal of W is zero.

    Rows whose diagonal of W (n, n), flat, is at most SINGULAR times the largest lose their
    off-diagonal elements, get the largest as diagonal, and b = 0, so that their impulse is zero.
    """
    most = 0.0
    for i in range(n):
        most = max(most, W[i * n + i])
    for i in range(n):
        if W[i * n + i] <= SINGULAR * most:
            for j in range(n):
                W[i * n + j] = W[j * n + i] = 0.0
            W[i * n + i] = most if most > 0 else 1.0
            b[i] = 0.0


@compiled
def energy_gain(W: np.ndarray, u: np.ndarray, p: np.ndarray, n: int) -> float:
    """Kinetic energy, J, that impulses p add to a motion with row velocities u: p (u + W p / 2); 0
    if it is a loss or rounding.
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
    """Scale impulses p (n,), which need not solve the contact laws, down so that they add no energy
    to row velocities u: p (u + W p / 2) <= 0.
    """
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
    """Move p (n,) towards ``soft``, the impulses without restitution, until it adds no energy to a
    motion with row velocities u. ``soft`` must add none.

    Newton's law with friction can add energy (Kane and Levinson 1985). Soft impulses never do: p u+
    <= 0 and so p (u + W p / 2) = p u+ - p W p / 2 < 0. Between both, all impulses are within their
    cones and nothing penetrates, as cones and half-spaces are convex.
    """
    a = b = c = 0.0
    for i in range(n):
        w = ws = 0.0
        for j in range(n):
            w += W[i * n + j] * (p[j] - soft[j])
            ws += W[i * n + j] * soft[j]
        a += (p[i] - soft[i]) * w / 2
        b += (p[i] - soft[i]) * (u[i] + ws)
        c += soft[i] * (u[i] + ws / 2)
    share = energy_bound_share(a, b, c)
    for i in range(n):
        p[i] = soft[i] + share * (p[i] - soft[i])
