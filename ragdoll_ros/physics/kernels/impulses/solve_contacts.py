"""Contact solve: impulses of all contacts and limits, at an impact or over a step, by islands.

An island is a set of dolls that contacts join. Islands do not act on each other and are solved one
by one.
"""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled
from ..contact.gaps import DEEP_PENETRATION
from ..contact.jacobian import apply_inverse_factor, contact_jacobian
from ..contact_kind import LIMIT
from ..dynamics.kinematics import Kinematics
from ..dynamics.mass_matrix import solve_lower
from ..system import MAX_DENSE_ROWS, System
from ..workspace import Workspace
from .large_island import solve_large
from .small_island import solve_small

CORRECTED_SHARE = 0.5
"""Share of a penetration that position correction removes in one step."""

MAX_SEPARATION_SPEED = 0.3
"""m/s at which deep penetrations are corrected at most, so that other bodies have time to yield."""

MAX_LIMIT_SPEED = 1.0
"""rad/s at which a joint far outside its limits is brought back at most."""

PAIR_COMPLIANCE, DEEP_PAIR_COMPLIANCE = 1e-4, 0.01
"""Compliance, as a share of W's diagonal, of position correction between bodies, and between bodies
with DEEP_PENETRATION: a limit or the ground, which do not yield, may be in the way."""

SEPARATING = 1e-3
"""m/s or rad/s: contacts that separate faster as a step begins have no friction in it."""

SLOP = 1e-8
"""m or rad of penetration that is not corrected, and of gap that is not closed: the points of a
resting face differ by as much, and the impulses to level them would be determined by nothing."""


@compiled
def label_islands(s: System, ws: Workspace, m: int) -> None:
    """Write the island of each of m contacts, the least index of its dolls, to found[].island.
    What touches a kinematic body is not joined by it.
    """
    label, contacts = ws.island.label, ws.contacts.found
    for d in range(len(label)):
        label[d] = d
    for i in range(m):
        c = contacts[i]
        if c.body_b >= 0 and not s.tree[c.body_a].kinematic and not s.tree[c.body_b].kinematic:
            a, b = label[s.body_doll[c.body_a]], label[s.body_doll[c.body_b]]
            if a != b:
                low, high = min(a, b), max(a, b)
                for d in range(len(label)):
                    if label[d] == high:
                        label[d] = low
    for i in range(m):
        c = contacts[i]
        moved = c.body_b if s.tree[c.body_a].kinematic and c.body_b >= 0 else c.body_a
        c.island = label[s.body_doll[moved]]


@compiled
def solve_contacts(s: System, ws: Workspace, kin: Kinematics, q: np.ndarray, v: np.ndarray,
                   v_free: np.ndarray, m: int, h: float, tolerance: float) -> None:
    """Solve m contacts over h s, or at an impact, h = 0. ``v_free``: what v becomes without them.
    Writes to ws.step the change of velocity by contacts, v_change (nv,), and the displacement by
    position correction, correction (nv,), m or rad, zero at an impact. contacts.found gives the
    contacts and their initial impulses, and receives the impulses.

    ``kin``: of q, with the roots' motion subspaces; dynamics.H: factor of the mass matrix.
    ``tolerance``: m/s of the residual of small islands.
    """
    contacts, island, L = ws.contacts.found, ws.island, ws.step.dynamics.H
    change, correction = ws.step.v_change, ws.step.correction
    for j in range(len(change)):
        change[j] = correction[j] = 0.0
    label_islands(s, ws, m)
    for begin in range(m):
        number = contacts[begin].island
        if number < 0:
            continue
        count, rows = collect_island(ws, begin, m, number)
        for k in range(count):
            i = island.members[k].contact
            contact_jacobian(s, kin, q, island, contacts[i], i, v, v_free)
            apply_inverse_factor(s.dof_parent, L, island, i, contacts[i])
        solve_island(s, ws, count, rows, h, tolerance)
        count_solve(s, ws, number, count, rows)
    solve_lower(L, s.dof_parent, change)
    if h > 0:
        solve_lower(L, s.dof_parent, correction)


@compiled
def collect_island(ws: Workspace, begin: int, m: int, number: int) -> tuple[int, int]:
    """Write the contacts of island ``number`` from found[begin] on to island.members, and number
    their rows. Returns the numbers of contacts and of rows that were written; those for which
    island.Y has no rows left are counted in stats.contacts_dropped. Marks all of them as done:
    their ``island`` becomes -1 - number.
    """
    count = rows = 0
    for i in range(begin, m):
        c = ws.contacts.found[i]
        if c.island != number:
            continue
        c.island = -1 - number
        if rows + c.kind > len(ws.island.Y):
            ws.stats[0].contacts_dropped += 1
            continue
        c.first_row = rows
        member = ws.island.members[count]
        member.contact, member.kind, member.row = i, c.kind, rows
        member.friction, member.rolling_friction = (
            c.patch_share * c.friction, c.rolling_friction)
        rows += c.kind
        count += 1
    return count, rows


@compiled
def count_solve(s: System, ws: Workspace, number: int, count: int, rows: int) -> None:
    """Add the contacts, rows, degrees of freedom and Newton steps of the solve of island ``number``
    to the counters of stats.ledger, and set its number of Newton steps back to 0.
    """
    ledger, island = ws.stats[0].ledger, ws.island
    ledger.solves += 1
    ledger.contacts += count
    ledger.rows += rows
    for j in range(len(s.dof_body)):
        if island.label[s.body_doll[s.dof_body[j]]] == number:
            ledger.dofs += 1
    ledger.newton_steps += island.newton_steps[0]
    island.newton_steps[0] = 0


@compiled
def assemble_rhs(s: System, ws: Workspace, m: int, n: int, h: float) -> tuple[bool, bool]:
    """Write the right-hand side of an island: copy the row velocities without impulses, island.rhs,
    to island.free_velocity, then add restitution and gaps to island.rhs. Also write the curvature
    bias, the initial impulses, and the penetration that each member is to correct. Returns whether
    island.rhs has restitution, and whether a member has penetration. After contact_jacobian().

    In the middle of a step, J v differs from its start by the curvature term h/2 dJ/dt v. The
    target of a persistent contact is minus that term, so that J v is 0 at the step's end.
    """
    island = ws.island
    b, was, curve = island.rhs, island.start_velocity, island.curvature
    has_restitution = has_penetration = False
    for j in range(n):
        island.free_velocity[j], curve[j] = b[j], 0.0
    for k in range(m):
        member = island.members[k]
        c = ws.contacts.found[member.contact]
        row = c.first_row
        member.correction = member.correction_compliance = member.compliance = 0.0
        member.separating = 0
        c.normal_velocity = was[row]
        bounces = c.restitution > 0 and c.normal_velocity < -s.restitution_speed[0]
        if h == 0.0:
            if bounces and not ws.stats[0].twist_changed:
                b[row] += c.restitution * c.normal_velocity
                has_restitution = True
        elif c.persistent:
            member.separating = 1 if c.start_velocity[0] > SEPARATING else 0
            for e in range(c.kind):
                curve[row + e] = was[row + e] - c.start_velocity[e]
            b[row] += max(0.0, c.gap - SLOP) / h
        elif not ws.step.scalars[0].seeks_impacts:
            if bounces and c.gap + h / 2 * c.normal_velocity <= 0:
                b[row] += c.restitution * c.normal_velocity
                has_restitution = True
            elif c.gap > 0:
                b[row] += c.gap / (h / 2)
        elif c.gap > 0:
            b[row] += c.gap / h
        if h > 0 and c.gap < 0:
            set_correction(ws, member, c, h)
            has_penetration |= member.correction > 0
        for e in range(c.kind):
            island.impulses[row + e] = c.impulse[e]
    return has_restitution, has_penetration


@compiled
def set_correction(ws: Workspace, member: np.record, c: np.record, h: float) -> None:
    """Write to ``member`` the ``correction`` of its penetration in h s, m or rad: CORRECTED_SHARE
    of what exceeds SLOP, at most at MAX_SEPARATION_SPEED or MAX_LIMIT_SPEED. Where impacts are not
    sought, a new contact gets all of its penetration, without a limit. Also write its
    correction_compliance if it is between two bodies.
    """
    fastest = MAX_LIMIT_SPEED if c.kind == LIMIT else MAX_SEPARATION_SPEED
    member.correction = min(CORRECTED_SHARE * max(0.0, -c.gap - SLOP), fastest * h)
    if not ws.step.scalars[0].seeks_impacts and not c.persistent:
        member.correction = -c.gap
    if c.body_b >= 0:
        member.correction_compliance = (
            DEEP_PAIR_COMPLIANCE if c.gap < -DEEP_PENETRATION else PAIR_COMPLIANCE)


@compiled
def solve_island(s: System, ws: Workspace, m: int, n: int, h: float, tolerance: float) -> None:
    """Solve one island of m contacts and n rows over h s, or at an impact, h = 0. Writes its
    impulses to found[].impulse. Adds Y^T times these to step.v_change, and Y^T times the impulses
    of position correction to step.correction; the caller multiplies both by L^-1.
    """
    island, change, correction = ws.island, ws.step.v_change, ws.step.correction
    has_restitution, has_penetration = assemble_rhs(s, ws, m, n, h)
    if n > MAX_DENSE_ROWS:
        solve_large(s, ws, m, n, h, has_restitution, has_penetration)
    else:
        solve_small(ws, m, n, h, tolerance, has_restitution, has_penetration)
    for k in range(m):
        i = island.members[k].contact
        c, support = ws.contacts.found[i], island.support[i]
        for e in range(c.kind):
            row = c.first_row + e
            c.impulse[e] = island.impulses[row]
            for x in range(c.dof_count):
                if c.impulse[e] != 0.0:
                    change[support[x]] += island.Y[row, x] * c.impulse[e]
                if has_penetration and e == 0:
                    correction[support[x]] += island.Y[row, x] * island.correction[row]
