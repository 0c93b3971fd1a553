"""How far boxes and cylinders are apart, and along which axis.

Along a unit vector n from b to a two convex bodies are s(n) = c n - h_a(n) - h_b(n) apart, c being
the way between their centres and h how far they reach; the largest s over all n is positive just
when they are disjoint, and where it is negative it is the least depth of penetration.

Two boxes: it stands on one of 15 axes, the normals of faces and the cross products of edges
(Gottschalk, Lin, Manocha, OBBTree, 1996). With a cylinder it may also stand where a rim touches an
edge or a rim. Then these axes are a start, from which two steps lead to the largest, both by the
distance of bodies that are apart, which has no other maxima (gjk.py):

- as long as the bodies overlap, they are shrunk about their centres until they come apart, which
  tells on which side to leave (growth distance: Gilbert, Ong, 1994);
- they are moved apart along n until a little is between them; the nearest points then show a
  better n. s never falls, and a few of these steps end at a maximum.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from .gjk import Direction, nearest_direction
from .shapes import BOX, CAPSULE, CYLINDER, bound, extent

PARALLEL = 1e-8
"""Sine between two edges below which the normals of faces do for their cross product."""

BIAS, BIAS_PART = 1e-7, 0.02
"""m, and a part of s: by how much the other axis must be better than a face's. Nearly parallel
faces tell their axes apart by rounding alone; what is overlooked is less than a contact's slop."""

SHRUNK = 0.98
"""Of the size at which bodies come apart: small enough for the nearest points to be well defined"""

BETWEEN = 1e-3
"""Of the bodies' size: what is put between them to find the nearest points."""

FAR = 1e9
"""m: more than any two bodies reach into each other."""

ROUGH, CLOSE = 1e-2, 1e-10
"""What part of the nearest points' distance may be wrong, at first and in the end."""

Axis = tuple[float, float, float, float]
"""s, m, and the unit vector n from b to a, world."""


@compiled
def along(kind_a: int, size_a: np.ndarray, ra: np.ndarray, kind_b: int, size_b: np.ndarray,
          rb: np.ndarray, cx: float, cy: float, cz: float, nx: float, ny: float,
          nz: float) -> float:
    """s(n), m."""
    return (cx * nx + cy * ny + cz * nz - extent(kind_a, size_a, ra, nx, ny, nz)
            - extent(kind_b, size_b, rb, nx, ny, nz))


@compiled
def best_axis(kind_a: int, size_a: np.ndarray, ra: np.ndarray, kind_b: int, size_b: np.ndarray,
              rb: np.ndarray, cx: float, cy: float, cz: float, bias: float, enough: float) -> Axis:
    """The axis of the largest s among normals of faces and cross products of edges. a may be the
    axis of a capsule, which is an edge.

    With a ``bias`` of 1, not 0, a's faces come before b's and these before edges.
    The first that is larger than ``enough`` will do.
    """
    s, x, y, z = -FAR, 0.0, 0.0, 0.0
    first_a, first_b = 0 if kind_a == BOX else 2, 0 if kind_b == BOX else 2
    faces_a = 3 if kind_a == CAPSULE else first_a
    bar = -FAR
    for body in range(2):
        r = ra if body == 0 else rb
        for k in range(faces_a if body == 0 else first_b, 3):
            nx, ny, nz = _facing(r[0, k], r[1, k], r[2, k], cx, cy, cz)
            found = along(kind_a, size_a, ra, kind_b, size_b, rb, cx, cy, cz, nx, ny, nz)
            if found > s and found > bar:
                s, x, y, z = found, nx, ny, nz
                if s > enough:
                    return s, x, y, z
        bar = s + bias * (BIAS + BIAS_PART * abs(s))
    for i in range(first_a, 3):
        for j in range(first_b, 3):
            nx = ra[1, i] * rb[2, j] - ra[2, i] * rb[1, j]
            ny = ra[2, i] * rb[0, j] - ra[0, i] * rb[2, j]
            nz = ra[0, i] * rb[1, j] - ra[1, i] * rb[0, j]
            length = math.sqrt(nx * nx + ny * ny + nz * nz)
            if length < PARALLEL:
                continue
            nx, ny, nz = _facing(nx / length, ny / length, nz / length, cx, cy, cz)
            found = along(kind_a, size_a, ra, kind_b, size_b, rb, cx, cy, cz, nx, ny, nz)
            if found > s and found > bar:
                s, x, y, z = found, nx, ny, nz
                if s > enough:
                    return s, x, y, z
    return s, x, y, z


@compiled
def _facing(x: float, y: float, z: float, cx: float, cy: float,
            cz: float) -> tuple[float, float, float]:
    """The axis, or its opposite, whichever goes along c."""
    if x * cx + y * cy + z * cz < 0:
        return -x, -y, -z
    return x, y, z


@compiled
def refined(kind_a: int, size_a: np.ndarray, ra: np.ndarray, kind_b: int, size_b: np.ndarray,
            rb: np.ndarray, cx: float, cy: float, cz: float, s: float, x: float, y: float,
            z: float) -> Axis:
    """The axis of the largest s of all, from the best of some axes."""
    # a bare 0 is a type of its own to numba, for which it would compile all once more
    points, count = np.empty((4, 6)), np.int64(0)
    gap = BETWEEN * (bound(kind_a, size_a) + bound(kind_b, size_b))
    if s < 0:
        count, ax, ay, az = _outward(
            kind_a, size_a, ra, kind_b, size_b, rb, cx, cy, cz, x, y, z, points)
        found = along(kind_a, size_a, ra, kind_b, size_b, rb, cx, cy, cz, ax, ay, az)
        if found > s:
            s, x, y, z = found, ax, ay, az
    for _ in range(20):
        move = max(gap - s, 0.0)
        count, ax, ay, az = nearest_direction(
            kind_a, size_a, ra, kind_b, size_b, rb, cx + move * x, cy + move * y, cz + move * z,
            1.0, CLOSE, points, count, x, y, z)
        found = along(kind_a, size_a, ra, kind_b, size_b, rb, cx, cy, cz, ax, ay, az)
        if found <= s:
            break
        gain, s, x, y, z = found - s, found, ax, ay, az
        if gain < 1e-13:
            break
    return s, x, y, z


@compiled
def widest_axis(kind_a: int, size_a: np.ndarray, ra: np.ndarray, kind_b: int, size_b: np.ndarray,
                rb: np.ndarray, cx: float, cy: float, cz: float, enough: float) -> Axis:
    """The axis of the largest s of all, or one of which s is larger than ``enough``."""
    s, x, y, z = best_axis(
        kind_a, size_a, ra, kind_b, size_b, rb, cx, cy, cz, 0.0, enough)
    if s <= enough and (kind_a == CYLINDER or kind_b == CYLINDER):
        return refined(kind_a, size_a, ra, kind_b, size_b, rb, cx, cy, cz, s, x, y, z)
    return s, x, y, z


@compiled
def _outward(kind_a: int, size_a: np.ndarray, ra: np.ndarray, kind_b: int, size_b: np.ndarray,
             rb: np.ndarray, cx: float, cy: float, cz: float, x: float, y: float, z: float,
              points: np.ndarray) -> Direction:
    """Along which axis bodies that grow about their centres meet: Dinkelbach's iteration."""
    most, count = 0.0, np.int64(0)
    bx, by, bz = x, y, z
    for _ in range(6):
        way = cx * x + cy * y + cz * z
        growth = way / (way - along(
            kind_a, size_a, ra, kind_b, size_b, rb, cx, cy, cz, x, y, z))
        if growth <= 1.001 * most:
            break
        most, bx, by, bz = growth, x, y, z
        count, x, y, z = nearest_direction(kind_a, size_a, ra, kind_b, size_b, rb, cx, cy, cz,
                                           SHRUNK * growth, ROUGH, points, count, x, y, z)
    return count, bx, by, bz
