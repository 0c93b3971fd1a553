"""Where boxes and cylinders touch: what of two flat features lies over each other, seen along n.

Each body shows an outline: a box the face that looks most along n, a cylinder its cap or a line of
its side. One outline is clipped by the sides of the other, which lies square to n (Sutherland,
Hodgman, 1974; Gregorius, Robust contact creation, GDC 2015). All is measured along n, not along
the face's normal, so that the deepest contact is as deep as the bodies are.
"""
from __future__ import annotations

import math

import numpy as np

from .collision_shapes import BOX, compiled, into, out_of

SQUARE = 0.1
"""Sine of the angle to n up to which a face, an edge or a line of a side counts as square to n."""

LYING = 0.7
"""Cosine between n and a cylinder's axis up to which it shows its side."""

SIDE_BY_SIDE = 1e-3
"""Sine between two lines up to which they touch at two points, not at one."""

MERGED = 1e-3
"""Points that are nearer to each other than this part of the reference's size are one."""

AGREED = 1e-10
"""m: by how much the deepest contact may differ from the depth of the bodies."""

CORNERS = 8
"""Corners of a disc, and the most contacts of a pair."""

ROOM = 20
"""Corners of a clipped outline: 8 of a disc, 8 sides, and a few that rounding may add."""

TOUCH = CORNERS * 32 - 1
"""Name of the contact at the nearest points, which no two sides of outlines have."""


@compiled
def outline(kind: int, size: np.ndarray, r: np.ndarray, x: float, y: float, z: float,
            corners: np.ndarray) -> tuple[int, int]:
    """Put the corners (k, 3), from the centre, world, of what a body shows along the unit vector.

    Gives k (4: face, 8: cap, 2: line) and the face's number. A cap has the corners of a regular
    octagon, but that the one next to the place that is farthest along the vector stands there.
    """
    x, y, z = into(r, x, y, z)
    if kind == BOX:
        return 4, _face(size, r, x, y, z, corners)
    across, end = math.sqrt(x * x + y * y), math.copysign(size[1], z)
    if abs(z) <= LYING:
        a, b = x * size[0] / across, y * size[0] / across
        corners[0, 0], corners[0, 1], corners[0, 2] = out_of(r, a, b, -size[1])
        corners[1, 0], corners[1, 1], corners[1, 2] = out_of(r, a, b, size[1])
        return 2, 2
    deepest = int(round(math.atan2(y, x) * CORNERS / (2 * math.pi))) % CORNERS
    for k in range(CORNERS):
        a, b = math.cos(2 * math.pi * k / CORNERS), math.sin(2 * math.pi * k / CORNERS)
        if k == deepest and across > 1e-9:
            a, b = x / across, y / across
        corners[k, 0], corners[k, 1], corners[k, 2] = out_of(r, size[0] * a, size[0] * b, end)
    return CORNERS, 0 if z > 0 else 1


@compiled
def _face(size: np.ndarray, r: np.ndarray, x: float, y: float, z: float,
          corners: np.ndarray) -> int:
    """Corners of a box's face that looks most along a vector of its frame; gives its number."""
    axis, most = 2, z
    if abs(x) > abs(most):
        axis, most = 0, x
    if abs(y) > abs(most):
        axis, most = 1, y
    i, j = (axis + 1) % 3, (axis + 2) % 3
    top = math.copysign(size[axis], most)
    for k in range(4):
        a, b = size[i] * (1 if k == 0 or k == 3 else -1), size[j] * (1 if k < 2 else -1)
        for e in range(3):
            corners[k, e] = r[e, axis] * top + r[e, i] * a + r[e, j] * b
    return axis * 2 + (1 if most < 0 else 0)


@compiled
def squareness(kind: int, r: np.ndarray, x: float, y: float, z: float) -> float:
    """Cosine between the unit vector and the nearest normal of a box's face or a cylinder's cap."""
    x, y, z = into(r, x, y, z)
    return max(abs(x), abs(y), abs(z)) if kind == BOX else abs(z)


@compiled
def line(kind: int, size: np.ndarray, r: np.ndarray, x: float, y: float,
         z: float) -> tuple[float, float, float, float, float, float]:
    """Middle, from the centre, and half of the edge, or the line of a side, that is farthest along
    the unit vector, world; of a corner or a place on a rim, which has no length, half is 0.
    """
    x, y, z = into(r, x, y, z)
    a, b, c, d, e, f = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if kind == BOX:
        a, b, c = (math.copysign(size[0], x), math.copysign(size[1], y), math.copysign(size[2], z))
        least = min(abs(x), abs(y), abs(z))
        if least < SQUARE:
            if abs(x) == least:
                a, d = 0.0, size[0]
            elif abs(y) == least:
                b, e = 0.0, size[1]
            else:
                c, f = 0.0, size[2]
    else:
        across = math.sqrt(x * x + y * y)
        if across > 0:
            a, b = x * size[0] / across, y * size[0] / across
        if abs(z) < SQUARE:
            f = size[1]
        else:
            c = math.copysign(size[1], z)
    a, b, c = out_of(r, a, b, c)
    d, e, f = out_of(r, d, e, f)
    return a, b, c, d, e, f


@compiled
def clip(corners: np.ndarray, count: int, nx: float, ny: float, nz: float, from_: np.ndarray,
         number: int, to: np.ndarray) -> tuple[int, bool]:
    """Cut an outline (number, 5) by the sides of another (count, 3), seen along n.

    The fourth is the number of the side that leaves the corner: 0 to 7 its own, from 8 on the
    other's. ``from_`` and ``to`` (ROOM, 5) take turns; gives how many corners are left, and whether
    they stand in ``from_``.
    """
    turn = _orientation(corners, nx, ny, nz)
    first = True
    for j in range(count):
        k = j + 1 if j + 1 < count else 0
        ex, ey = corners[k, 0] - corners[j, 0], corners[k, 1] - corners[j, 1]
        ez = corners[k, 2] - corners[j, 2]
        # the side's plane holds n; inside is where m x <= m corner
        mx, my, mz = turn * (ey * nz - ez * ny), turn * (ez * nx - ex * nz), turn * (
            ex * ny - ey * nx)
        at = mx * corners[j, 0] + my * corners[j, 1] + mz * corners[j, 2]
        if first:
            number = _cut(from_, number, mx, my, mz, at, CORNERS + j, to)
        else:
            number = _cut(to, number, mx, my, mz, at, CORNERS + j, from_)
        first = not first
        if number == 0:
            break
    return number, first


@compiled
def _orientation(corners: np.ndarray, nx: float, ny: float, nz: float) -> float:
    """1 if the corners go round n anticlockwise, else -1."""
    ax, ay, az = (corners[1, 0] - corners[0, 0], corners[1, 1] - corners[0, 1],
                  corners[1, 2] - corners[0, 2])
    bx, by, bz = (corners[2, 0] - corners[0, 0], corners[2, 1] - corners[0, 1],
                  corners[2, 2] - corners[0, 2])
    volume = (nx * (ay * bz - az * by) + ny * (az * bx - ax * bz) + nz * (ax * by - ay * bx))
    return 1.0 if volume > 0 else -1.0


@compiled
def _cut(rows: np.ndarray, number: int, mx: float, my: float, mz: float, at: float, side: int,
         out: np.ndarray) -> int:
    """What of an outline has m x <= at; the new side gets the number ``side``."""
    count = 0
    previous = rows[number - 1]
    before = mx * previous[0] + my * previous[1] + mz * previous[2] - at
    for i in range(number):
        row = rows[i]
        now = mx * row[0] + my * row[1] + mz * row[2] - at
        if (now <= 0) != (before <= 0) and count < ROOM:
            t = before / (before - now)
            for e in range(3):
                out[count, e] = previous[e] + t * (row[e] - previous[e])
            out[count, 3] = previous[3] if now <= 0 else side
            count += 1
        if now <= 0 and count < ROOM:
            for e in range(4):
                out[count, e] = row[e]
            count += 1
        previous, before = row, now
    return count
