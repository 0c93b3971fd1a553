"""Contacts: points that are nearer than a margin, with their directions and arms."""
from __future__ import annotations

import math

import numpy as np

from ..collision.pair import collide
from ..compiling.decorators import compiled
from ..maths.quaternion import cross
from ..system import Workspace, System
from .gaps import TOUCHING, ground_point
from .patch import contract_friction_points


@compiled
def find_contacts(s: System, q: np.ndarray, r: Workspace, gaps: np.ndarray, margin: float) -> int:
    """Enter all contacts whose gap in ``gaps`` says that they touch, as they are at q, into
    r.contacts; of a pair those points that are nearer than ``margin``. Their number.

    Work is posed at q and the geoms are placed.
    """
    m, n, most = 0, 0, len(r.contacts)
    for k in range(len(s.geoms)):
        geom = s.geoms[k]
        if s.ground_offset[0] > -math.inf:
            for j in range(geom.point_count):
                if gaps[n + j] <= TOUCHING and m < most:
                    c = r.contacts[m]
                    c.kind = 5 if geom.rolling_friction > 0 else 3
                    c.a, c.b, c.id, c.patch = geom.bone, -1, n + j, k
                    ground_point(geom, j, r.geom_positions[k], r.geom_rotations[k], s.ground_normal, c.point)
                    high = -s.ground_offset[0]
                    for e in range(3):
                        c.normal[e] = s.ground_normal[e]
                        high += c.point[e] * s.ground_normal[e]
                    c.gap = high
                    c.friction, c.rolling_friction = geom.friction, geom.rolling_friction
                    c.restitution = geom.restitution
                    m += 1
        n += geom.point_count
    for k in range(len(s.joint_limits)):
        for side in range(2):
            if gaps[n + side] <= TOUCHING and m < most:
                c, bound = r.contacts[m], s.joint_limits[k]
                c.kind, c.a, c.b, c.id, c.patch = 1, bound.dof, -1, n + side, -1
                c.normal[0] = 1.0 if side == 0 else -1.0
                c.gap = q[bound.q_index] - bound.lower if side == 0 else bound.upper - q[bound.q_index]
                c.friction = c.rolling_friction = c.restitution = 0.0
                m += 1
        n += 2
    for k in range(len(s.pairs)):
        if gaps[n + k] <= TOUCHING:
            m = add_pair_contacts(s, k, r, m, margin, n + len(s.pairs) + 4096 * k)
    set_friction_points(s, r, m)
    return m


@compiled
def add_pair_contacts(s: System, k: int, r: Workspace, m: int, margin: float, key: int) -> int:
    """Enter the points of a pair's patch; the number of contacts after."""
    pair = s.pairs[k]
    a, b = s.geoms[pair.a], s.geoms[pair.b]
    found = collide(a.kind, a.size, r.geom_positions[pair.a], r.geom_rotations[pair.a], b.kind, b.size, r.geom_positions[pair.b],
                    r.geom_rotations[pair.b], margin, r.table)
    for j in range(found):
        if m >= len(r.contacts):
            break
        c, row = r.contacts[m], r.table[j]
        c.kind = 5 if pair.rolling_friction > 0 else 3
        c.a, c.b, c.id, c.patch = a.bone, b.bone, key + int(row[7]), len(s.geoms) + k
        for e in range(3):
            c.point[e], c.normal[e] = row[e], row[3 + e]
        c.gap = row[6]
        c.friction, c.rolling_friction, c.restitution = pair.friction, pair.rolling_friction, pair.restitution
        m += 1
    return m


@compiled
def set_friction_points(s: System, r: Workspace, m: int) -> None:
    """Where friction acts: in a patch nearer its middle than the points that bear it.

    Under an even pressure p a patch that turns about its middle brakes with mu times the integral
    of p times the distance: with the mean distance of its area, not that of its corners.
    """
    c = 0
    while c < m:
        d = c + 1
        group = r.contacts[c].patch
        while d < m and r.contacts[d].patch == group and group >= 0:
            d += 1
        for e in range(c, d):
            set_tangents(r.contacts[e])
            for k in range(3):
                r.contacts[e].friction_point[k] = r.contacts[e].point[k]
        if d - c > 2 and group < len(s.geoms) and s.geoms[group].kind == 3:
            project_to_disc(s.geoms[group], r.geom_positions[group], r.geom_rotations[group], r.contacts, c, d)
        elif d - c > 1:
            contract_friction_points(r, c, d)
        c = d


@compiled
def project_to_disc(geom: np.record, at: np.ndarray, turn: np.ndarray, contacts: np.ndarray, begin: int,
            end: int) -> None:
    """Draw the arms of a cylinder's face, which stands on the ground, to two thirds of its radius,
    the mean distance of a disc.
    """
    c = contacts[begin]
    side = turn[0, 2] * c.normal[0] + turn[1, 2] * c.normal[1] + turn[2, 2] * c.normal[2]
    low = -geom.size[1] if side > 0 else geom.size[1]
    for e in range(begin, end):
        c = contacts[e]
        for k in range(3):
            middle = at[k] + turn[k, 2] * low
            c.friction_point[k] = middle + 2 / 3 * (c.point[k] - middle)


@compiled
def set_tangents(c: np.record) -> None:
    """Two directions across a contact's normal."""
    n = c.normal
    if abs(n[2]) > 0.7:
        x, y, z = 1 - n[0] * n[0], -n[0] * n[1], -n[0] * n[2]
    else:
        x, y, z = -n[2] * n[0], -n[2] * n[1], 1 - n[2] * n[2]
    size = math.sqrt(x * x + y * y + z * z)
    x, y, z = x / size, y / size, z / size
    c.tangents[0, 0], c.tangents[0, 1], c.tangents[0, 2] = x, y, z
    c.tangents[1, 0], c.tangents[1, 1], c.tangents[1, 2] = cross(n[0], n[1], n[2], x, y, z)
