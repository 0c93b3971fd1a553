"""That a step keeps momentum: of each doll that does not touch the ground, to rounding.

A centred step in generalised coordinates keeps the momentum at its middle pose, that at its end but
to third order. What it has missed is given back as a motion of the whole doll as one rigid body.
With the impulses J of all that acts from outside at points x, over h s:
P' = P + m g h + J, C' = C + h (P + P') / (2 m), L' = L + (x - (C + C') / 2) x J about the centre of
mass C. So the sums over dolls that touch each other are kept as well.
"""
from __future__ import annotations

import math

import numpy as np

from .cholesky import solve
from .dynamics import pose
from .machine import compiled
from .mass import turn_inertias
from .quaternion import cross, turned
from .system import Room, System

SMALL = 0.01
"""Share of the energy of the bones against each other that a step may be corrected by."""

SUMS = 17
"""Of a doll: mass, centre (3) m, momentum (3), angular momentum (3) about the centre, and the
inertia (6) about it as if its joints were locked: xx, xy, xz, yy, yz, zz; the kinetic energy, J."""


@compiled
def sum_dolls(s: System, q: np.ndarray, v: np.ndarray, r: Room, out: np.ndarray) -> None:
    """Sums (d, SUMS) over each doll; poses work at q and v."""
    pose(s.tree, q, v, r.work)
    turn_inertias(s.tree, r.work, r.own)
    for d in range(len(out)):
        for k in range(SUMS):
            out[d, k] = 0.0
    for i in range(len(s.tree)):
        row, c, m = out[s.doll_of[i]], r.work.centres[i], s.tree[i].mass
        root = s.tree[s.root_of[i]].q
        move = r.work.moves[i]
        x, y, z = cross(move[0], move[1], move[2], c[0], c[1], c[2])
        row[0] += m
        for k in range(3):
            row[1 + k] += m * (q[root + k] + c[k])
        row[4] += m * (move[3] + x)
        row[5] += m * (move[4] + y)
        row[6] += m * (move[5] + z)
    for d in range(len(out)):
        for k in range(3):
            out[d, 1 + k] /= out[d, 0]
    for i in range(len(s.tree)):
        row, c, m = out[s.doll_of[i]], r.work.centres[i], s.tree[i].mass
        root = s.tree[s.root_of[i]].q
        move, I = r.work.moves[i], r.own[i]
        x, y, z = cross(move[0], move[1], move[2], c[0], c[1], c[2])
        a, b, e = q[root] + c[0] - row[1], q[root + 1] + c[1] - row[2], q[root + 2] + c[2] - row[3]
        wx, wy, wz = move[0], move[1], move[2]
        lx = I[0] * wx + I[1] * wy + I[2] * wz
        ly = I[1] * wx + I[3] * wy + I[4] * wz
        lz = I[2] * wx + I[4] * wy + I[5] * wz
        x, y, z = move[3] + x, move[4] + y, move[5] + z
        row[16] += (m * (x * x + y * y + z * z) + lx * wx + ly * wy + lz * wz) / 2
        x, y, z = cross(a, b, e, m * x, m * y, m * z)
        row[7] += x + lx
        row[8] += y + ly
        row[9] += z + lz
        row[10] += I[0] + m * (b * b + e * e)
        row[11] += I[1] - m * a * b
        row[12] += I[2] - m * a * e
        row[13] += I[3] + m * (a * a + e * e)
        row[14] += I[4] - m * b * e
        row[15] += I[5] + m * (a * a + b * b)


@compiled
def give(given: np.ndarray, doll: int, sign: float, x: float, y: float, z: float, jx: float,
         jy: float, jz: float) -> None:
    """Enter an impulse, N s, at a point of the world, m, into a doll's row of ``given`` (d, 10)."""
    row = given[doll]
    row[0] += sign * jx
    row[1] += sign * jy
    row[2] += sign * jz
    a, b, c = cross(x, y, z, jx, jy, jz)
    row[3] += sign * a
    row[4] += sign * b
    row[5] += sign * c


@compiled
def give_contacts(s: System, r: Room, m: int, given: np.ndarray) -> None:
    """Enter the impulses of m contacts; given[:, 6] becomes 1 for dolls that the ground bears."""
    for n in range(m):
        c = r.contacts[n]
        if c.kind == 1:
            continue
        one = s.doll_of[c.a]
        other = s.doll_of[c.b] if c.b >= 0 else -1
        if other < 0:
            if c.impulse[0] > 0:
                given[one, 6] = 1.0
            continue
        if one == other:
            continue
        p, t, w = c.impulse, c.across[0], c.across[1]
        for doll, sign in ((one, 1.0), (other, -1.0)):
            give(given, doll, sign, c.point[0], c.point[1], c.point[2], p[0] * c.normal[0],
                 p[0] * c.normal[1], p[0] * c.normal[2])
            give(given, doll, sign, c.arm[0], c.arm[1], c.arm[2], p[1] * t[0] + p[2] * w[0],
                 p[1] * t[1] + p[2] * w[1], p[1] * t[2] + p[2] * w[2])
            if c.kind == 5:
                for k in range(3):
                    given[doll, 3 + k] += sign * (p[3] * t[k] + p[4] * w[k])


@compiled
def keep_momentum(s: System, r: Room, h: float, before: np.ndarray, after: np.ndarray,
                  given: np.ndarray, q: np.ndarray, v: np.ndarray) -> None:
    """Change q and v at a step's end, before which the centres were at given[:, 7:10], so that each
    doll which the ground does not bear has the momentum and the place that are due; ``before``,
    ``after``: sums (d, SUMS).
    """
    matrix, turn = r.work.matrix, r.table[14]
    for i in range(len(s.tree)):
        bone = s.tree[i]
        d = s.doll_of[i]
        if bone.parent >= 0 or given[d, 6] > 0:
            continue
        old, new, row, m = before[d], after[d], given[d], before[d, 0]
        at, rate = bone.q, bone.v
        gained, mean = r.table[12], r.table[13]
        for k in range(3):
            due = old[4 + k] + row[k] + m * s.gravity[k] * h
            place = old[1 + k] + h * (old[4 + k] + due) / (2 * m)
            mean[k] = (old[1 + k] + place) / 2
            mean[3 + k] = place - row[7 + k]
            gained[k] = (due - new[4 + k]) / m
        x, y, z = cross(mean[0], mean[1], mean[2], row[0], row[1], row[2])
        turn[0] = old[7] + row[3] - x - new[7]
        turn[1] = old[8] + row[4] - y - new[8]
        turn[2] = old[9] + row[5] - z - new[9]
        matrix[0, 0], matrix[1, 1], matrix[2, 2] = new[10], new[13], new[15]
        matrix[0, 1] = matrix[1, 0] = new[11]
        matrix[0, 2] = matrix[2, 0] = new[12]
        matrix[1, 2] = matrix[2, 1] = new[14]
        solve(matrix, turn[:3])
        x, y, z = cross(turn[0], turn[1], turn[2], q[at] - new[1], q[at + 1] - new[2],
                        q[at + 2] - new[3])
        v[rate] += gained[0] + x
        v[rate + 1] += gained[1] + y
        v[rate + 2] += gained[2] + z
        x, y, z = turned(q[at + 3], q[at + 4], q[at + 5], -q[at + 6], turn[0], turn[1], turn[2])
        v[rate + 3] += x
        v[rate + 4] += y
        v[rate + 5] += z
        for k in range(3):
            q[at + k] += mean[3 + k]


@compiled
def keep_energy(s: System, r: Room, gained: float, after: np.ndarray, given: np.ndarray,
                q: np.ndarray, v: np.ndarray) -> bool:
    """Take energy that came from nothing out of how the bones of dolls that the ground does not
    bear move against each other; momenta stay. Whether it was but a small part of that.

    ``after``: sums (d, SUMS) at q and v. v becomes w + s (v - w), w the doll's motion as one rigid
    body; the energy of v - w is what is left beside the rigid body's.
    """
    matrix, spin, inner = r.work.matrix, r.table[14], 0.0
    for d in range(len(after)):
        if given[d, 6] == 0.0:
            lock(after[d], matrix, spin)
            inner += after[d, 16] - rigid_energy(after[d], spin)
    if not inner * SMALL > gained:
        return False
    share = math.sqrt(1 - gained / inner)
    for i in range(len(s.tree)):
        bone, d = s.tree[i], s.doll_of[i]
        if given[d, 6] > 0:
            continue
        if bone.parent >= 0:
            for k in range(bone.dof):
                v[bone.v + k] *= share
            continue
        new, at, rate = after[d], bone.q, bone.v
        lock(new, matrix, spin)
        x, y, z = cross(spin[0], spin[1], spin[2], q[at] - new[1], q[at + 1] - new[2],
                        q[at + 2] - new[3])
        x, y, z = new[4] / new[0] + x, new[5] / new[0] + y, new[6] / new[0] + z
        v[rate] = x + share * (v[rate] - x)
        v[rate + 1] = y + share * (v[rate + 1] - y)
        v[rate + 2] = z + share * (v[rate + 2] - z)
        x, y, z = turned(q[at + 3], q[at + 4], q[at + 5], -q[at + 6], spin[0], spin[1], spin[2])
        v[rate + 3] = x + share * (v[rate + 3] - x)
        v[rate + 4] = y + share * (v[rate + 4] - y)
        v[rate + 5] = z + share * (v[rate + 5] - z)
    return True


@compiled
def lock(row: np.ndarray, matrix: np.ndarray, spin: np.ndarray) -> None:
    """Angular velocity (3,) rad/s of a doll with its momentum as one rigid body."""
    matrix[0, 0], matrix[1, 1], matrix[2, 2] = row[10], row[13], row[15]
    matrix[0, 1] = matrix[1, 0] = row[11]
    matrix[0, 2] = matrix[2, 0] = row[12]
    matrix[1, 2] = matrix[2, 1] = row[14]
    for k in range(3):
        spin[k] = row[7 + k]
    solve(matrix, spin[:3])


@compiled
def rigid_energy(row: np.ndarray, spin: np.ndarray) -> float:
    """Kinetic energy, J, of that body."""
    return ((row[4] ** 2 + row[5] ** 2 + row[6] ** 2) / row[0] + spin[0] * row[7]
            + spin[1] * row[8] + spin[2] * row[9]) / 2
