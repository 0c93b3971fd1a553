"""Contacts: points that are nearer than a margin, with their directions and arms."""
from __future__ import annotations

import math

import numpy as np

from ..collision.narrow_phase import collide
from ..collision.shapes import CYLINDER, shape_at
from ..compiling.decorators import compiled
from ..maths.quaternion import cross
from ..system import Room, System
from .gaps import TOUCHING, ground_point
from .patch import shrink


@compiled
def find_contacts(s: System, q: np.ndarray, r: Room, gaps: np.ndarray, margin: float) -> int:
    """Enter all contacts whose gap in ``gaps`` says that they touch, as they are at q, into
    r.contacts; of a pair those points that are nearer than ``margin``. Their number.

    Work is posed at q and the geoms are placed.
    """
    m, n, most = 0, 0, len(r.contacts)
    for k in range(len(s.geoms)):
        geom = s.geoms[k]
        if s.offset[0] > -math.inf:
            for j in range(geom.count):
                if gaps[n + j] <= TOUCHING and m < most:
                    c = r.contacts[m]
                    c.kind = 5 if geom.rolling > 0 else 3
                    c.a, c.b, c.key, c.group = geom.bone, -1, n + j, k
                    ground_point(geom, j, r.at[k], r.turn[k], s.normal, c.point)
                    high = -s.offset[0]
                    for e in range(3):
                        c.normal[e] = s.normal[e]
                        high += c.point[e] * s.normal[e]
                    c.gap = high
                    c.friction, c.rolling = geom.friction, geom.rolling
                    c.restitution = geom.restitution
                    m += 1
        n += geom.count
    for k in range(len(s.bounds)):
        for side in range(2):
            if gaps[n + side] <= TOUCHING and m < most:
                c, bound = r.contacts[m], s.bounds[k]
                c.kind, c.a, c.b, c.key, c.group = 1, bound.v, -1, n + side, -1
                c.normal[0] = 1.0 if side == 0 else -1.0
                c.gap = q[bound.q] - bound.lower if side == 0 else bound.upper - q[bound.q]
                c.friction = c.rolling = c.restitution = 0.0
                m += 1
        n += 2
    for k in range(len(s.pairs)):
        if gaps[n + k] <= TOUCHING:
            m = enter_pair(s, k, r, m, margin, n + len(s.pairs) + 4096 * k)
    arms(s, r, m)
    return m


@compiled
def enter_pair(s: System, k: int, r: Room, m: int, margin: float, key: int) -> int:
    """Enter the points of a pair's patch; the number of contacts after."""
    pair = s.pairs[k]
    a, b = s.geoms[pair.a], s.geoms[pair.b]
    found = collide(shape_at(a, r.at[pair.a], r.turn[pair.a]),
                    shape_at(b, r.at[pair.b], r.turn[pair.b]), margin, r.manifold)
    for j in range(found):
        if m >= len(r.contacts):
            break
        c, contact = r.contacts[m], r.manifold[j]
        c.kind = 5 if pair.rolling > 0 else 3
        c.a, c.b, c.key, c.group = a.bone, b.bone, key + contact.feature_id, len(s.geoms) + k
        for e in range(3):
            c.point[e], c.normal[e] = contact.point[e], contact.normal[e]
        c.gap = contact.gap
        c.friction, c.rolling, c.restitution = pair.friction, pair.rolling, pair.restitution
        m += 1
    return m


@compiled
def arms(s: System, r: Room, m: int) -> None:
    """Where friction acts: in a patch nearer its middle than the points that bear it.

    Under an even pressure p a patch that turns about its middle brakes with mu times the integral
    of p times the distance: with the mean distance of its area, not that of its corners.
    """
    c = 0
    while c < m:
        d = c + 1
        group = r.contacts[c].group
        while d < m and r.contacts[d].group == group and group >= 0:
            d += 1
        for e in range(c, d):
            basis(r.contacts[e])
            for k in range(3):
                r.contacts[e].arm[k] = r.contacts[e].point[k]
        if d - c > 2 and group < len(s.geoms) and s.geoms[group].kind == CYLINDER:
            on_disc(s.geoms[group], r.at[group], r.turn[group], r.contacts, c, d)
        elif d - c > 1:
            shrink(r, c, d)
        c = d


@compiled
def on_disc(geom: np.record, at: np.ndarray, turn: np.ndarray, contacts: np.ndarray, begin: int,
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
            c.arm[k] = middle + 2 / 3 * (c.point[k] - middle)


@compiled
def basis(c: np.record) -> None:
    """Two directions across a contact's normal."""
    n = c.normal
    if abs(n[2]) > 0.7:
        x, y, z = 1 - n[0] * n[0], -n[0] * n[1], -n[0] * n[2]
    else:
        x, y, z = -n[2] * n[0], -n[2] * n[1], 1 - n[2] * n[2]
    size = math.sqrt(x * x + y * y + z * z)
    x, y, z = x / size, y / size, z / size
    c.across[0, 0], c.across[0, 1], c.across[0, 2] = x, y, z
    c.across[1, 0], c.across[1, 1], c.across[1, 2] = cross(n[0], n[1], n[2], x, y, z)
