"""A large island: its contacts by Gauss-Seidel sweeps through their rows, without W, and by
Newton's method where contacts join dolls so that it costs less.

To form and factor W of hundreds of rows costs more than to do without it: a sweep through z = Y^T p
costs as many operations as the rows have entries, and anderson.py makes sweeps converge. In a stack
impulses travel by one body per sweep: sparse_newton.py.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..contact_kind import LIMIT, ROLLING
from ..system import COMPLIANCE, NO_SLIP, System
from ..workspace import Island, Workspace
from ..maths.anderson import accelerate
from .one_contact import project_to_disc, solve_one_contact
from .solver import OPENING, UNSOLVABLE, UNSOLVED, energy_bound_share, scale_to_no_work
from .sparse_newton import find_sparsity, linearize, sparse_newton, write_velocities

LARGE_ROUNDS, LARGE_SWEEPS = 3, 10
"""Rounds of sweeps and of Newton's method, and sweeps in the first; in each other one twice as many
as in the one before. At rest few will do."""

MAX_SWEEPS = 100
"""Sweeps in one solve where Newton's method would cost more."""

TOLERANCE = 1e-6
"""m/s, or m of a correction: the least residual to which a large island is solved."""

SWEPT_SHARE = 0.01
"""Change in a sweep as a share of the tolerance: in a tall stack it is far less than what is
missing."""

CORRECTION_ERROR = 0.01
"""Residual of position correction, as a share of the largest one: half of a penetration is left to
the next step in any case, and at rest all of it, as no kinetic energy is there to pay for a lift.
"""

SWEEP_WORK = 200.0
"""Work of an elimination, as find_pattern() counts it, up to which Newton's method takes no longer
than MAX_SWEEPS sweeps through a matrix of one entry."""

IMMOVABLE = 1e30
"""Takes the place of W's diagonal entry for a row along which nothing can move."""


@compiled
def solve_large(s: System, ws: Workspace, m: int, n: int, h: float, has_restitution: bool,
                has_penetration: bool) -> None:
    """Solve an island over h s as solve_small() does, but without W and curvature bias, to its own
    tolerance, and with COMPLIANCE also at impacts. Impulses never add energy. Raises
    scalars.residual to the residual left.
    """
    island, b, p, u = (ws.island, ws.island.rhs, ws.island.impulses, ws.island.free_velocity)
    island.newton_dofs[0] = -1
    tolerance = max(TOLERANCE, ws.step.scalars[0].solve_error * min(
        largest(u, n), largest(island.start_velocity, n)))
    diagonal_blocks(ws, m, COMPLIANCE)
    scale_initial_impulses(ws, m, n, b, p)
    left, sweeps = solve_rows(s, ws, m, n, b, p, tolerance, LARGE_ROUNDS)
    if release_opening_contacts(ws, m, b, p):
        left, more = solve_rows(s, ws, m, n, b, p, tolerance, LARGE_ROUNDS)
        sweeps += more
    work, spent = work_terms(island, n, u, p)
    failed = has_restitution and h > 0 and not left <= max(UNSOLVABLE, tolerance)
    if failed or (has_restitution and work + spent / 2 > 0):
        left = reduce_restitution(s, ws, m, n, tolerance, failed)
        work, spent = work_terms(island, n, u, p)
    ws.stats[0].sweeps += sweeps
    if not left <= max(UNSOLVED, tolerance):
        ws.stats[0].unsolved += 1
    if not work + spent / 2 <= 0:
        scale_to_no_work(p, n, work, spent)
    ws.step.scalars[0].residual = max(ws.step.scalars[0].residual, left)
    if has_penetration:
        keep_normals_only(island, m)
        for i in range(n):
            b[i] = island.correction[i] = 0.0
        for k in range(m):
            b[island.members[k].row] = -island.members[k].correction
        tolerance = max(TOLERANCE, CORRECTION_ERROR * largest(b, n))
        solve_rows(s, ws, m, n, b, island.correction, tolerance, 1)


@compiled
def largest(values: np.ndarray, n: int) -> float:
    """The largest size of the first n of ``values``."""
    most = 0.0
    for i in range(n):
        most = max(most, abs(values[i]))
    return most


@compiled
def scale_initial_impulses(ws: Workspace, m: int, n: int, b: np.ndarray, p: np.ndarray) -> None:
    """Scale the initial impulses p (n,) by the share from 0 to 1 that minimizes p (b + W p / 2):
    after an impact, those of the step before are too large. Overwrites island.z and island.velocity
    with those of the unscaled p.
    """
    write_velocities(ws, m, b, p)
    work, spent = work_terms(ws.island, n, b, p)
    share = min(1.0, max(0.0, -work / spent)) if spent > 0 else 1.0
    for i in range(n):
        p[i] *= share


@compiled
def newton_dof_count(s: System, ws: Workspace, m: int) -> int:
    """Return the number of degrees of freedom for sparse_newton() on an island, after
    find_sparsity(); 0 if an elimination takes more work than SWEEP_WORK times the number of entries
    of the island's rows, or if memory is short. Computed once for an island and kept in
    island.newton_dofs.
    """
    known = ws.island.newton_dofs
    if known[0] < 0:
        dofs, work = find_sparsity(s, ws, m)
        entries = 0
        for k in range(m):
            member = ws.island.members[k]
            entries += member.kind * ws.contacts.found[member.contact].dof_count
        known[0] = dofs if 0 <= work <= SWEEP_WORK * entries else 0
    return known[0]


@compiled
def solve_rows(s: System, ws: Workspace, m: int, n: int, b: np.ndarray, p: np.ndarray,
               tolerance: float, rounds: int) -> tuple[float, int]:
    """Solve the contact laws on the row velocities W p + b for the impulses p (n,), in place from
    the given p: in at most ``rounds`` rounds of sweeps and, where these stall, Newton's method. If
    that costs too much, a last run of at most MAX_SWEEPS sweeps replaces it.

    b (n,): row velocities without p, m/s; for position correction displacements, m. Returns the
    residual, m/s or m, and the number of sweeps; if sweeps came last, the residual is the largest
    velocity change of the last sweep. island.z becomes Y^T p.
    """
    left, done, most = linearize(ws, m, b, p)[0], 0, LARGE_SWEEPS
    for _ in range(rounds):
        if left <= tolerance:
            break
        left, sweeps = sweep_to_tolerance(ws, m, n, b, p, most, SWEPT_SHARE * tolerance)
        done, most = done + sweeps, 2 * most
        if left <= SWEPT_SHARE * tolerance:
            break
        dofs = newton_dof_count(s, ws, m)
        if not dofs:
            left, sweeps = sweep_to_tolerance(ws, m, n, b, p, MAX_SWEEPS, tolerance)
            return left, done + sweeps
        left = sparse_newton(ws, m, n, b, p, tolerance, dofs)
    return left, done


@compiled
def reduce_restitution(s: System, ws: Workspace, m: int, n: int, tolerance: float,
                       failed: bool) -> float:
    """Move island.impulses towards the impulses without restitution until they add no energy, see
    small_island.bound_energy(). If ``failed``, the solve with restitution found no solution, and
    they are replaced. Overwrites island.soft. Returns the residual of the solve without
    restitution, m/s; island.z becomes Y^T p.
    """
    island = ws.island
    p, soft, u, z, bounced = (island.impulses, island.soft, island.free_velocity, island.z,
                              island.z_direction)
    for i in range(n):
        soft[i] = 0.0 if failed else p[i]
    left, _ = solve_rows(s, ws, m, n, u, soft, tolerance, LARGE_ROUNDS)
    work, spent = work_terms(island, n, u, soft)
    if not work + spent / 2 <= 0:
        scale_to_no_work(soft, n, work, spent)
    write_velocities(ws, m, u, p)
    for j in range(len(z)):
        bounced[j] = z[j]
    write_velocities(ws, m, u, soft)
    a = b = c = 0.0
    for i in range(n):
        b += (p[i] - soft[i]) * u[i]
        c += soft[i] * u[i]
    for j in range(len(z)):
        step = bounced[j] - z[j]
        a += step * step / 2
        b += step * z[j]
        c += z[j] * z[j] / 2
    share = 0.0 if failed else energy_bound_share(a, b, c)
    for i in range(n):
        p[i] = soft[i] + share * (p[i] - soft[i])
    write_velocities(ws, m, u, p)
    ws.stats[0].restitution_reduced += 1
    return left


@compiled
def diagonal_blocks(ws: Workspace, m: int, compliance: float) -> None:
    """Write the diagonal blocks of W to island.blocks, their diagonal entries times 1 +
    ``compliance``, or IMMOVABLE where they are zero. Sets each members[].compliance to
    ``compliance``.
    """
    island = ws.island
    for k in range(m):
        c, block = ws.contacts.found[island.members[k].contact], island.blocks[k]
        island.members[k].compliance = compliance
        for e in range(c.kind):
            for g in range(e + 1):
                total = 0.0
                for x in range(c.dof_count):
                    total += island.Y[c.first_row + e, x] * island.Y[c.first_row + g, x]
                block[e, g] = block[g, e] = total
            own = block[e, e]
            block[e, e] = (1 + compliance) * own if own > 0 else IMMOVABLE


@compiled
def keep_normals_only(island: Island, m: int) -> None:
    """Reduce each contact to its normal row, with the compliance of position correction."""
    for k in range(m):
        member, block = island.members[k], island.blocks[k]
        block[0, 0] *= (1 + member.correction_compliance) / (1 + member.compliance)
        member.kind, member.compliance = LIMIT, member.correction_compliance


@compiled
def row_velocity(ws: Workspace, k: int, e: int, b: np.ndarray, p: np.ndarray) -> float:
    """Return the velocity, m/s or rad/s, along row e of member k: b + W p there, with the member's
    compliance in W. island.z must be Y^T p.
    """
    island, member = ws.island, ws.island.members[k]
    row, soft, support = member.row + e, member.compliance, island.support[member.contact]
    total = b[row] + p[row] * island.blocks[k, e, e] * soft / (1 + soft)
    for x in range(ws.contacts.found[member.contact].dof_count):
        total += island.Y[row, x] * island.z[support[x]]
    return total


@compiled
def change_impulse(ws: Workspace, k: int, e: int, change: float, p: np.ndarray) -> float:
    """Add ``change`` to the impulse of row e of member k in p, and its effect to island.z. Returns
    the size of the row's change of velocity, m/s or rad/s.
    """
    island, member = ws.island, ws.island.members[k]
    row, support = member.row + e, island.support[member.contact]
    p[row] += change
    for x in range(ws.contacts.found[member.contact].dof_count):
        island.z[support[x]] += island.Y[row, x] * change
    return abs(change) * island.blocks[k, e, e]


@compiled
def sweep_large_island(ws: Workspace, m: int, b: np.ndarray, p: np.ndarray) -> float:
    """Solve each of m contacts in turn for its impulses, in place in p; island.z stays Y^T p.
    Returns the largest change of a velocity, m/s or rad/s.
    """
    worst = 0.0
    for k in range(m):
        member, block = ws.island.members[k], ws.island.blocks[k]
        a, mu = member.row, member.friction
        u0 = row_velocity(ws, k, 0, b, p)
        if member.kind == LIMIT:
            worst = max(worst, change_impulse(
                ws, k, 0, max(0.0, p[a] - u0 / block[0, 0]) - p[a], p))
            continue
        x, y, w = p[a], p[a + 1], p[a + 2]
        if u0 >= 0 and x == 0.0 and y == 0.0 and w == 0.0 and mu < NO_SLIP:
            continue
        u1, u2 = row_velocity(ws, k, 1, b, p), row_velocity(ws, k, 2, b, p)
        c = (u0 - block[0, 0] * x - block[0, 1] * y - block[0, 2] * w,
             u1 - block[1, 0] * x - block[1, 1] * y - block[1, 2] * w,
             u2 - block[2, 0] * x - block[2, 1] * y - block[2, 2] * w)
        nx, ny, nw = solve_one_contact(block.reshape(25), 5, 0, c, (x, y, w), mu)
        worst = max(worst, change_impulse(ws, k, 0, nx - x, p),
                    change_impulse(ws, k, 1, ny - y, p), change_impulse(ws, k, 2, nw - w, p))
        if member.kind == ROLLING:
            most = member.rolling_friction * nx
            rho = 1 / max(block[3, 3], block[4, 4])
            x, y = project_to_disc(p[a + 3] - rho * row_velocity(ws, k, 3, b, p),
                                   p[a + 4] - rho * row_velocity(ws, k, 4, b, p), most)
            worst = max(worst, change_impulse(ws, k, 3, x - p[a + 3], p),
                        change_impulse(ws, k, 4, y - p[a + 4], p))
    return worst


@compiled
def sweep_to_tolerance(ws: Workspace, m: int, n: int, b: np.ndarray, p: np.ndarray,
                       most: int, tolerance: float) -> tuple[float, int]:
    """Solve for p (n,) in place, starting from p, by at most ``most`` sweeps with Anderson
    acceleration, until a sweep changes no velocity by more than ``tolerance``, m/s or rad/s.
    Returns the largest change in the last sweep and the number of sweeps. island.z becomes Y^T p.
    Overwrites island.residual.
    """
    island, weights = ws.island, ws.island.residual
    start, z = island.anderson.start, island.z
    for j in range(len(z)):
        z[j] = 0.0
    for k in range(m):
        member = island.members[k]
        for e in range(member.kind):
            row = member.row + e
            weights[row] = math.sqrt(island.blocks[k, e, e])
            impulse, p[row] = p[row], 0.0
            change_impulse(ws, k, e, impulse, p)
    worst, done = 0.0, 0
    for turn in range(most):
        for i in range(n):
            start[i] = p[i]
        worst = sweep_large_island(ws, m, b, p)
        done += 1
        if worst <= tolerance or done == most:
            break
        accelerate(island.anderson, weights, n, turn, p, z)
    return worst, done


@compiled
def release_opening_contacts(ws: Workspace, m: int, b: np.ndarray, p: np.ndarray) -> bool:
    """Make contacts that cannot slip (friction >= NO_SLIP) frictionless, by a friction of -1, and
    set their impulses to zero, if they have tangential impulse but no normal one, and open faster
    than OPENING. Returns whether there are any. island.z is not updated.
    """
    some = False
    for k in range(m):
        member = ws.island.members[k]
        a = member.row
        if member.kind != LIMIT and member.friction >= NO_SLIP and p[a] <= 0.0 and (
                p[a + 1] != 0.0 or p[a + 2] != 0.0) and (
                row_velocity(ws, k, 0, b, p) > OPENING):
            member.friction, some = -1.0, True
            p[a] = p[a + 1] = p[a + 2] = 0.0
    return some


@compiled
def work_terms(island: Island, n: int, u: np.ndarray, p: np.ndarray) -> tuple[float, float]:
    """The terms p u and p W p, J, of impulses p on row velocities u; island.z is Y^T p."""
    work = spent = 0.0
    for i in range(n):
        work += p[i] * u[i]
    for j in range(len(island.z)):
        spent += island.z[j] ** 2
    return work, spent
