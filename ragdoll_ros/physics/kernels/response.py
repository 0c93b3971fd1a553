"""What contacts and limits answer: impulses at an impact, and over a step, island by island.

An island is what contacts join; islands do not feel each other and are solved one by one.
"""
from __future__ import annotations

import math

import numpy as np

from .cholesky import solve
from .contact import BURIED, jacobian, through_factor
from .machine import compiled
from .large_island import let_go, normals_alone, own_blocks, sweep_island, work_and_spent
from .mass import solve_lower
from .solver import solve_impulses, solve_normals
from .system import LARGE, Room, System

SWEEPS = 4
"""Sweeps before Newton's method is asked for the first time."""

GIVEN_BACK = 0.5
"""Share of a depth that one step gives back, in position alone."""

FASTEST_OUT = 0.3
"""m/s at which what began far inside is brought out at the most: what is in its way has time to
move on."""

YIELDING = 0.01
"""Compliance, as a share of their own W, at which bones BURIED in each other are brought apart: a
limit or the ground may be in the way, and do not yield."""

FASTEST_BACK = 1.0
"""rad/s at which a joint that began far outside is brought back at the most."""

UNSOLVED = 1e-5
"""m/s: what is left by more is counted, and its impulses are kept from making energy."""

ROUGHLY = 1e-2
"""The same of a large island."""

LOCKED = 1e-13
"""Share of the largest ease, W, of an island's rows up to which one is locked."""

COMPLIANCE, OF_IMPACTS = 1e-8, 1e-10
"""Of contacts and limits, as a share of their own W, in steps and at impacts: what several of them
bear together is then decided, and their impulses stay small where they jam. What rests on a slope
creeps by some 1e-10 m/s for it, and what strikes misses as large a share of its velocity."""

NO_MOTION = 1e-4
"""Share of W's diagonal up to which no motion of the bodies is what rows see of a curved way."""

STRAIGHT = 1e-11
"""m/s or rad/s: of a way that is less curved, nobody asks whether it is a motion."""

OPENING = 1e-3
"""m/s or rad/s: what comes apart faster as a step begins is not held sideways in it."""

SLACK = 1e-9
"""m or rad that nobody gives back."""


@compiled
def label_islands(s: System, r: Room, m: int) -> None:
    """Give each of m contacts its island, the least of its dolls' numbers."""
    label = r.label
    for d in range(len(label)):
        label[d] = d
    for i in range(m):
        c = r.contacts[i]
        if c.b >= 0:
            a, b = label[s.doll_of[c.a]], label[s.doll_of[c.b]]
            if a != b:
                low, high = min(a, b), max(a, b)
                for d in range(len(label)):
                    if label[d] == high:
                        label[d] = low
    for i in range(m):
        c = r.contacts[i]
        bone = s.bone_of[c.a] if c.kind == 1 else c.a
        c.island = label[s.doll_of[bone]]


@compiled
def respond(s: System, r: Room, q: np.ndarray, v: np.ndarray, free: np.ndarray, m: int, h: float,
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
        count, rows = collect(r, begin, m, island)
        for k in range(count):
            i = int(r.need[1, k])
            jacobian(s, q, r, r.contacts[i], i, v, free, r.p[0], r.p[5])
            through_factor(s.up, r.H, r.Y, r.support[i], r.contacts[i], r.place)
        solve_island(s, r, count, rows, h, tolerance, change, shift)
    solve_lower(r.H, s.up, change)
    if h > 0:
        solve_lower(r.H, s.up, shift)


@compiled
def collect(r: Room, begin: int, m: int, island: int) -> tuple[int, int]:
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
            r.tally[0].left_out += 1
            continue
        c.row = rows
        r.kinds[count], r.rows[count] = c.kind, rows
        r.mu[count], r.roll[count], r.need[1, count] = c.friction, c.rolling, i
        rows += c.kind
        count += 1
    return count, rows


@compiled
def ask(s: System, r: Room, count: int, n: int, h: float, tolerance: float) -> tuple[bool, bool]:
    """What the rows of an island are to come to, r.p[0], beside what they come to by themselves,
    r.p[3]; how fast depths are given back, r.need[0]. Whether something is thrown back, and
    whether something is deep.
    """
    b, p, start, curve, was = r.p[0], r.p[1], r.p[3], r.p[4], r.p[5]
    thrown = deep = False
    for j in range(n):
        start[j], curve[j] = b[j], 0.0
    for k in range(count):
        c = r.contacts[int(r.need[1, k])]
        r.need[0, k] = r.need[2, k] = r.need[3, k] = 0.0
        c.before = was[c.row]
        if h == 0.0:
            if c.restitution > 0 and c.before < -s.bounce_speed[0]:
                b[c.row] += c.restitution * c.before
                thrown = True
        elif c.begun:
            r.need[3, k] = 1.0 if c.start[0] > OPENING else 0.0
            for e in range(c.kind):
                curve[c.row + e] = was[c.row + e] - c.start[e]
        elif r.unsought[0] and c.restitution > 0 and c.before < -s.bounce_speed[0]:
            b[c.row] += c.restitution * c.before
        elif c.gap > 0:
            b[c.row] += c.gap / h
        if h > 0 and c.gap < 0:
            fastest = FASTEST_BACK if c.kind == 1 else FASTEST_OUT
            r.need[0, k] = min(GIVEN_BACK * max(0.0, -c.gap - SLACK), fastest * h)
            if r.unsought[0] and not c.begun:
                r.need[0, k] = -c.gap
            deep |= r.need[0, k] > 0
            if c.b >= 0 and c.kind > 1 and c.gap < -BURIED:
                r.need[2, k] = YIELDING
        for e in range(c.kind):
            p[c.row + e] = c.impulse[e]
    return thrown, deep


@compiled
def form_W(r: Room, count: int, n: int, compliance: float) -> None:
    """W = Y Y^T, flat (n * n), its diagonal with the compliance."""
    Y, W, wide = r.Y, r.W, r.vectors[5]
    for j in range(len(wide)):
        wide[j] = 0.0
    for k in range(count):
        i = int(r.need[1, k])
        a, size = r.rows[k], r.contacts[i].support
        for e in range(a, a + r.kinds[k]):
            for x in range(size):
                wide[r.support[i, x]] = Y[e, x]
            for g in range(k + 1):
                j = int(r.need[1, g])
                for f in range(r.rows[g], r.rows[g] + r.kinds[g]):
                    if f <= e:
                        total = 0.0
                        for x in range(r.contacts[j].support):
                            total += Y[f, x] * wide[r.support[j, x]]
                        W[e * n + f] = W[f * n + e] = total
            for x in range(size):
                wide[r.support[i, x]] = 0.0
    for i in range(n):
        W[i * n + i] *= 1 + compliance


@compiled
def solve_small(s: System, r: Room, count: int, n: int, h: float, tolerance: float, thrown: bool,
                deep: bool) -> None:
    """Solve for the impulses r.p[1], those that give depths back r.p[2], of an island by its W."""
    b, p, start, soft = r.p[0], r.p[1], r.p[3], r.p[4]
    form_W(r, count, n, COMPLIANCE if h > 0 else OF_IMPACTS)
    if h > 0:
        follow_curve(r, count, n)
    rest_locked(r.W, n, b)
    left, turns = solve_impulses(r.kinds, r.rows, r.mu, r.roll, count, n, r.W, b, p, tolerance,
                                 SWEEPS, r.solver, r.G)
    if thrown and gained(r.W, start, p, n) > 0:
        for j in range(n):
            soft[j] = p[j]
        solve_impulses(r.kinds, r.rows, r.mu, r.roll, count, n, r.W, start, soft, tolerance, SWEEPS,
                       r.solver, r.G)
        hold_energy(r.W, start, soft, p, n)
        r.tally[0].softened += 1
    r.tally[0].sweeps += turns
    if not left <= UNSOLVED:
        r.tally[0].unsolved += 1
        weaken_impulses(r.W, start, p, n)
    if deep:
        solve_normals(r.kinds, r.rows, r.mu, r.roll, count, n, r.W, r.need, r.p[2], r.solver, r.G)


@compiled
def solve_large(r: Room, count: int, n: int, h: float, thrown: bool, deep: bool) -> None:
    """The same without W. What is thrown back so that it would make energy is not; curved ways
    are taken as straight.
    """
    b, p, out, start = r.p[0], r.p[1], r.p[2], r.p[3]
    own_blocks(r, count, COMPLIANCE)
    left, turns = sweep_island(r, count, n, b, p)
    if let_go(r, count, b, p):
        left, more = sweep_island(r, count, n, b, p)
        turns += more
    work, spent = work_and_spent(r, n, start, p)
    if thrown and work + spent / 2 > 0:
        left, more = sweep_island(r, count, n, start, p)
        turns += more
        r.tally[0].softened += 1
        work, spent = work_and_spent(r, n, start, p)
    r.tally[0].sweeps += turns
    if not left <= ROUGHLY:
        r.tally[0].unsolved += 1
        if not work + spent / 2 <= 0:
            share = max(0.0, -2 * work / spent) if spent > 0 else 0.0
            for i in range(n):
                p[i] = share * p[i] if math.isfinite(p[i]) and math.isfinite(share) else 0.0
    if deep:
        normals_alone(r, count)
        for i in range(n):
            b[i] = out[i] = 0.0
        for k in range(count):
            b[r.rows[k]] = -r.need[0, k]
        sweep_island(r, count, n, b, out)


@compiled
def solve_island(s: System, r: Room, count: int, n: int, h: float, tolerance: float,
                 change: np.ndarray, shift: np.ndarray) -> None:
    """Solve for the impulses of one island and add what they do to ``change`` and ``shift``, both
    still to go through L.
    """
    thrown, deep = ask(s, r, count, n, h, tolerance)
    if n > LARGE:
        solve_large(r, count, n, h, thrown, deep)
    else:
        solve_small(s, r, count, n, h, tolerance, thrown, deep)
    for k in range(count):
        i = int(r.need[1, k])
        c = r.contacts[i]
        for e in range(c.kind):
            row = c.row + e
            c.impulse[e] = r.p[1, row]
            for x in range(c.support):
                j = r.support[i, x]
                if c.impulse[e] != 0.0:
                    change[j] += r.Y[row, x] * c.impulse[e]
                if deep and e == 0:
                    shift[j] += r.Y[row, x] * r.p[2, row]


@compiled
def rest_locked(W: np.ndarray, n: int, b: np.ndarray) -> None:
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
def follow_curve(r: Room, count: int, n: int) -> None:
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
    solve(G[:n * n].reshape((n, n)), x[:n])
    for i in range(n):
        b[i] += curve[i] - (NO_MOTION * W[i * n + i] + LOCKED * most) * x[i]


@compiled
def gained(W: np.ndarray, u: np.ndarray, p: np.ndarray, n: int) -> float:
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
def weaken_impulses(W: np.ndarray, u: np.ndarray, p: np.ndarray, n: int) -> None:
    """Scale impulses that are no solution so that they make no energy; no number becomes none."""
    work = spent = 0.0
    for i in range(n):
        w = 0.0
        for j in range(n):
            w += W[i * n + j] * p[j]
        work += p[i] * u[i]
        spent += p[i] * w
    share = min(1.0, max(0.0, -2 * work / spent)) if spent > 0 else 0.0
    if not math.isfinite(share) or not math.isfinite(work):
        share = 0.0
    for i in range(n):
        p[i] = share * p[i] if share > 0 else 0.0


@compiled
def hold_energy(W: np.ndarray, u: np.ndarray, soft: np.ndarray, p: np.ndarray, n: int) -> None:
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
    c = min(0.0, gained(W, u, soft, n))
    root = math.sqrt(max(0.0, b * b - 4 * a * c))
    share = (-2 * c / (b + root) if b > 0 else (root - b) / (2 * a)) if a > 0 else 1.0
    share = min(1.0, max(0.0, share))
    for i in range(n):
        p[i] = soft[i] + share * (p[i] - soft[i])
