"""What contacts and limits answer: impulses at an impact, and over a step, island by island.

An island is what contacts join; islands do not feel each other and are solved one by one.
"""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled
from ..contact.gaps import BURIED
from ..contact.jacobian import contact_jacobian, apply_inverse_factor
from ..dynamics.mass_matrix import solve_lower
from ..system import MAX_DENSE_ROWS, Workspace, System
from .large_island import solve_large
from .small_island import solve_small

GIVEN_BACK = 0.5
"""Share of a depth that one step gives back, in position alone."""

FASTEST_OUT = 0.3
"""m/s at which what began far inside is brought out at the most: what is in its way has time to
move on."""

YIELDING, BURIED_YIELDING = 1e-4, 0.01
"""Compliance, as a share of their own W, at which bones in each other are brought apart, and bones
BURIED in each other: a limit or the ground may be in the way, which do not yield."""

FASTEST_BACK = 1.0
"""rad/s at which a joint that began far outside is brought back at the most."""

PARTING = 1e-3
"""m/s or rad/s: what comes apart faster as a step begins is not held sideways in it."""

SLACK = 1e-8
"""m or rad that nobody gives back, nor closes: the points of a face that rests differ by as much,
and impulses that were to level them would be decided by nothing else."""


@compiled
def label_islands(s: System, r: Workspace, m: int) -> None:
    """Give each of m contacts its island, the least of its dolls' numbers."""
    label = r.label
    for d in range(len(label)):
        label[d] = d
    for i in range(m):
        c = r.contacts[i]
        if c.b >= 0:
            a, b = label[s.body_doll[c.a]], label[s.body_doll[c.b]]
            if a != b:
                low, high = min(a, b), max(a, b)
                for d in range(len(label)):
                    if label[d] == high:
                        label[d] = low
    for i in range(m):
        c = r.contacts[i]
        bone = s.dof_body[c.a] if c.kind == 1 else c.a
        c.island = label[s.body_doll[bone]]


@compiled
def solve_contacts(s: System, r: Workspace, q: np.ndarray, v: np.ndarray, free: np.ndarray, m: int, h: float,
            tolerance: float, change: np.ndarray, shift: np.ndarray) -> None:
    """Change of velocity (nv,) by m contacts, where v becomes ``free`` without them in h s, and the
    ``shift`` that gives depths back. h = 0: an impact. r.H holds the factor, work the axes, at q.
    """
    for j in range(len(change)):
        change[j] = shift[j] = 0.0
    label_islands(s, r, m)
    for begin in range(m):
        island = r.contacts[begin].island
        if island < 0:
            continue
        count, rows = collect_island(r, begin, m, island)
        for k in range(count):
            i = int(r.need[1, k])
            contact_jacobian(s, q, r, r.contacts[i], i, v, free, r.p[0], r.p[5])
            apply_inverse_factor(s.dof_parent, r.H, r.Y, r.support[i], r.contacts[i], r.place)
        solve_island(s, r, count, rows, h, tolerance, change, shift)
    solve_lower(r.H, s.dof_parent, change)
    if h > 0:
        solve_lower(r.H, s.dof_parent, shift)


@compiled
def collect_island(r: Workspace, begin: int, m: int, island: int) -> tuple[int, int]:
    """Number the contacts of an island, r.need[1], and their rows; how many of each.

    Those for which there is no room are counted and left out.
    """
    count = rows = 0
    for i in range(begin, m):
        c = r.contacts[i]
        if c.island != island:
            continue
        c.island = -1 - island
        if rows + c.kind > len(r.Y):
            r.stats[0].contacts_dropped += 1
            continue
        c.first_row = rows
        r.kinds[count], r.rows[count] = c.kind, rows
        r.mu[count], r.roll[count], r.need[1, count] = c.friction, c.rolling_friction, i
        rows += c.kind
        count += 1
    return count, rows


@compiled
def assemble_rhs(s: System, r: Workspace, count: int, n: int, h: float) -> tuple[bool, bool]:
    """Enter what the rows of an island come to without impulses, r.p[3], and what of that impulses
    are to answer, r.p[0]; what they see of a curved way, r.p[4]; impulses to begin with, r.p[1];
    what of depths is given back, r.need[0]. Whether something is thrown back, or deep.
    """
    b, p, start, curve, was = r.p[0], r.p[1], r.p[3], r.p[4], r.p[5]
    thrown = deep = False
    for j in range(n):
        start[j], curve[j] = b[j], 0.0
    for k in range(count):
        c = r.contacts[int(r.need[1, k])]
        r.need[0, k] = r.need[2, k] = r.need[3, k] = 0.0
        c.approach_velocity = was[c.first_row]
        if h == 0.0:
            if c.restitution > 0 and c.approach_velocity < -s.restitution_speed[0]:
                b[c.first_row] += c.restitution * c.approach_velocity
                thrown = True
        elif c.persistent:
            r.need[3, k] = 1.0 if c.start_velocity[0] > PARTING else 0.0
            for e in range(c.kind):
                curve[c.first_row + e] = was[c.first_row + e] - c.start_velocity[e]
            b[c.first_row] += max(0.0, c.gap - SLACK) / h
        elif r.unsought[0] and c.restitution > 0 and c.approach_velocity < -s.restitution_speed[0]:
            b[c.first_row] += c.restitution * c.approach_velocity
        elif c.gap > 0:
            b[c.first_row] += c.gap / h
        if h > 0 and c.gap < 0:
            fastest = FASTEST_BACK if c.kind == 1 else FASTEST_OUT
            r.need[0, k] = min(GIVEN_BACK * max(0.0, -c.gap - SLACK), fastest * h)
            if r.unsought[0] and not c.persistent:
                r.need[0, k] = -c.gap
            deep |= r.need[0, k] > 0
            if c.b >= 0 and c.kind > 1:
                r.need[2, k] = BURIED_YIELDING if c.gap < -BURIED else YIELDING
        for e in range(c.kind):
            p[c.first_row + e] = c.impulse[e]
    return thrown, deep


@compiled
def solve_island(s: System, r: Workspace, count: int, n: int, h: float, tolerance: float,
                 change: np.ndarray, shift: np.ndarray) -> None:
    """Solve for the impulses of one island and add what they do to ``change`` and ``shift``, both
    still to go through L.
    """
    thrown, deep = assemble_rhs(s, r, count, n, h)
    if n > MAX_DENSE_ROWS:
        solve_large(r, count, n, h, thrown, deep)
    else:
        solve_small(r, count, n, h, tolerance, thrown, deep)
    for k in range(count):
        i = int(r.need[1, k])
        c = r.contacts[i]
        for e in range(c.kind):
            row = c.first_row + e
            c.impulse[e] = r.p[1, row]
            for x in range(c.dof_count):
                j = r.support[i, x]
                if c.impulse[e] != 0.0:
                    change[j] += r.Y[row, x] * c.impulse[e]
                if deep and e == 0:
                    shift[j] += r.Y[row, x] * r.p[2, row]
