"""Outlines cut by each other, and the points of a patch that are worth keeping.

Sutherland, Hodgman, Reentrant polygon clipping, 1974; Gregorius, Robust contact creation for
physics simulations, GDC 2015.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from .outline import CORNERS

MOST = 8
"""Contacts of a pair."""

ROOM = 20
"""Corners of a clipped outline: 8 of a disc, 8 sides, and a few that rounding may add."""


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


@compiled
def merge(found: np.ndarray, count: int, margin: float, apart: float) -> int:
    """Drop points that are farther than the margin, and of two in one place the higher."""
    kept = 0
    for i in range(count):
        if found[i, 4] > margin:
            continue
        place = kept
        for k in range(kept):
            if _square(found[i], found[k]) < apart * apart:
                place = k
        if place == kept:
            kept += 1
        elif found[i, 4] >= found[place, 4]:
            continue
        for e in range(5):
            found[place, e] = found[i, e]
    return kept


@compiled
def spread(found: np.ndarray, count: int) -> int:
    """Bring the deepest point to the front, and behind it, each time, the farthest from all."""
    if count <= MOST:
        return count
    best = 0
    for i in range(count):
        if found[i, 4] < found[best, 4]:
            best = i
    for k in range(MOST):
        if k > 0:
            best, most = k, -1.0
            for i in range(k, count):
                nearest = math.inf
                for j in range(k):
                    nearest = min(nearest, _square(found[i], found[j]))
                if nearest > most:
                    best, most = i, nearest
        for e in range(5):
            found[k, e], found[best, e] = found[best, e], found[k, e]
    return MOST


@compiled
def _square(a: np.ndarray, b: np.ndarray) -> float:
    """Square of the distance of two points."""
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    return x * x + y * y + z * z
