"""A large island: what its contacts answer, by sweeps through their rows.

W of hundreds of rows costs more to build and to factor than to do without: a sweep through
z = Y^T p costs what the rows have of entries. Between the sweeps goes a step along the direction
of Fletcher and Reeves, which makes them converge ten times as fast (Silcowitz-Hansen, Niebe and
Erleben, The Visual Computer 26, 2010).
"""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled
from ..system import COMPLIANCE, NO_SLIP, Workspace
from .one_contact import project_to_disc, solve_one_contact
from .solver import OPENING, scale_to_no_work
from .gauss_seidel import LIMIT, ROLLING

MOST_SWEEPS = 100
"""Of a large island."""

GOOD = 1e-6
"""m/s to which a large island is solved, if that many sweeps bring it there."""

LOCKED = 1e30
"""Of a row along which nothing can move, instead of its W."""

ROUGHLY = 1e-2
"""m/s: what is left by more is counted, and its impulses are kept from making energy."""


@compiled
def solve_large(r: Workspace, count: int, n: int, h: float, thrown: bool, deep: bool) -> None:
    """Solve an island as solve_small() does, but that what is thrown back so that it would make
    energy is not thrown, and that curved ways are taken as straight.
    """
    b, p, out, start = r.p[0], r.p[1], r.p[2], r.p[3]
    diagonal_blocks(r, count, COMPLIANCE)
    left, turns = gauss_seidel_large(r, count, n, b, p)
    if release_opening_contacts(r, count, b, p):
        left, more = gauss_seidel_large(r, count, n, b, p)
        turns += more
    work, spent = work_terms(r, n, start, p)
    if thrown and work + spent / 2 > 0:
        left, more = gauss_seidel_large(r, count, n, start, p)
        turns += more
        r.stats[0].restitution_reduced += 1
        work, spent = work_terms(r, n, start, p)
    r.stats[0].sweeps += turns
    if not left <= ROUGHLY:
        r.stats[0].unsolved += 1
        if not work + spent / 2 <= 0:
            scale_to_no_work(p, n, work, spent)
    r.left[0] = max(r.left[0], left)
    if deep:
        keep_normals_only(r, count)
        for i in range(n):
            b[i] = out[i] = 0.0
        for k in range(count):
            b[r.rows[k]] = -r.need[0, k]
        gauss_seidel_large(r, count, n, b, out)


@compiled
def diagonal_blocks(r: Workspace, count: int, compliance: float) -> None:
    """W of each contact by itself, r.blocks (count, 25), its diagonal with the compliance."""
    for k in range(count):
        i = int(r.need[1, k])
        c = r.contacts[i]
        r.need[3, k] = compliance
        for e in range(c.kind):
            for g in range(e + 1):
                total = 0.0
                for x in range(c.dof_count):
                    total += r.Y[c.first_row + e, x] * r.Y[c.first_row + g, x]
                r.blocks[k, 5 * e + g] = r.blocks[k, 5 * g + e] = total
            own = r.blocks[k, 6 * e]
            r.blocks[k, 6 * e] = (1 + compliance) * own if own > 0 else LOCKED


@compiled
def keep_normals_only(r: Workspace, count: int) -> None:
    """Leave of each contact its normal, with the compliance r.need[2] instead of r.need[3]."""
    for k in range(count):
        r.blocks[k, 0] *= (1 + r.need[2, k]) / (1 + r.need[3, k])
        r.kinds[k], r.need[3, k] = LIMIT, r.need[2, k]


@compiled
def row_velocity(r: Workspace, k: int, e: int, b: np.ndarray, p: np.ndarray, z: np.ndarray) -> float:
    """Velocity along row e of contact k."""
    i = int(r.need[1, k])
    row, soft = r.rows[k] + e, r.need[3, k]
    total = b[row] + p[row] * r.blocks[k, 6 * e] * soft / (1 + soft)
    for x in range(r.contacts[i].dof_count):
        total += r.Y[row, x] * z[r.support[i, x]]
    return total


@compiled
def give(r: Workspace, k: int, e: int, change: float, p: np.ndarray, z: np.ndarray) -> float:
    """Change the impulse of row e of contact k; by how much its velocity changes."""
    i = int(r.need[1, k])
    row = r.rows[k] + e
    p[row] += change
    for x in range(r.contacts[i].dof_count):
        z[r.support[i, x]] += r.Y[row, x] * change
    return abs(change) * r.blocks[k, 6 * e]


@compiled
def sweep_large_island(r: Workspace, count: int, b: np.ndarray, p: np.ndarray, z: np.ndarray) -> float:
    """Go once through the contacts; the largest change of a velocity, m/s or rad/s."""
    worst = 0.0
    for k in range(count):
        a, own = r.rows[k], r.blocks[k]
        u0 = row_velocity(r, k, 0, b, p, z)
        if r.kinds[k] == LIMIT:
            worst = max(worst, give(r, k, 0, max(0.0, p[a] - u0 / own[0]) - p[a], p, z))
            continue
        x, y, w = p[a], p[a + 1], p[a + 2]
        if u0 >= 0 and x == 0.0 and y == 0.0 and w == 0.0 and r.mu[k] < NO_SLIP:
            continue
        u1, u2 = row_velocity(r, k, 1, b, p, z), row_velocity(r, k, 2, b, p, z)
        c0 = u0 - own[0] * x - own[1] * y - own[2] * w
        c1 = u1 - own[5] * x - own[6] * y - own[7] * w
        c2 = u2 - own[10] * x - own[11] * y - own[12] * w
        nx, ny, nw = solve_one_contact(own, 5, 0, c0, c1, c2, x, y, w, r.mu[k])
        worst = max(worst, give(r, k, 0, nx - x, p, z), give(r, k, 1, ny - y, p, z),
                    give(r, k, 2, nw - w, p, z))
        if r.kinds[k] == ROLLING:
            most = r.roll[k] * nx
            rho = 1 / max(own[18], own[24])
            x, y = project_to_disc(p[a + 3] - rho * row_velocity(r, k, 3, b, p, z),
                           p[a + 4] - rho * row_velocity(r, k, 4, b, p, z), most)
            worst = max(worst, give(r, k, 3, x - p[a + 3], p, z),
                        give(r, k, 4, y - p[a + 4], p, z))
    return worst


@compiled
def gauss_seidel_large(r: Workspace, count: int, n: int, b: np.ndarray, p: np.ndarray) -> tuple[float, int]:
    """Solve for p (n,), from where it stands; the last change of a velocity, m/s, and the sweeps.

    r.vectors[5] is z = Y^T p at the end.
    """
    z, z_was, z_way = r.vectors[5], r.vectors[6], r.vectors[7]
    was, way = r.solver[0], r.solver[1]
    for j in range(len(z)):
        z[j] = z_way[j] = 0.0
    for i in range(n):
        way[i] = 0.0
    for k in range(count):
        for e in range(r.kinds[k]):
            begun, p[r.rows[k] + e] = p[r.rows[k] + e], 0.0
            give(r, k, e, begun, p, z)
    worst, done, before = 0.0, 0, 0.0
    for _ in range(MOST_SWEEPS):
        for i in range(n):
            was[i] = p[i]
        for j in range(len(z)):
            z_was[j] = z[j]
        worst = sweep_large_island(r, count, b, p, z)
        done += 1
        if worst <= GOOD or done == MOST_SWEEPS:
            break
        square = 0.0
        for k in range(count):
            for e in range(r.kinds[k]):
                row = r.rows[k] + e
                square += (p[row] - was[row]) ** 2 * r.blocks[k, 6 * e]
        share = square / before if before > 0 else 0.0
        before = square
        if share > 1:
            share = 0.0
        for i in range(n):
            step = p[i] - was[i]
            p[i] += share * way[i]
            way[i] = share * way[i] + step
        for j in range(len(z)):
            step = z[j] - z_was[j]
            z[j] += share * z_way[j]
            z_way[j] = share * z_way[j] + step
    return worst, done


@compiled
def release_opening_contacts(r: Workspace, count: int, b: np.ndarray, p: np.ndarray) -> bool:
    """Let go sideways the contacts without friction's limit that open; whether there are any."""
    some = False
    for k in range(count):
        a = r.rows[k]
        if r.kinds[k] != LIMIT and r.mu[k] >= NO_SLIP and p[a] <= 0.0 and (
                p[a + 1] != 0.0 or p[a + 2] != 0.0) and (
                row_velocity(r, k, 0, b, p, r.vectors[5]) > OPENING):
            r.mu[k], some = -1.0, True
            p[a] = p[a + 1] = p[a + 2] = 0.0
    return some


@compiled
def work_terms(r: Workspace, n: int, u: np.ndarray, p: np.ndarray) -> tuple[float, float]:
    """What impulses p, of which r.vectors[5] is z, do to what moves at u: p u, and p W p, J."""
    work = spent = 0.0
    for i in range(n):
        work += p[i] * u[i]
    for j in range(r.vectors.shape[1]):
        spent += r.vectors[5, j] ** 2
    return work, spent
