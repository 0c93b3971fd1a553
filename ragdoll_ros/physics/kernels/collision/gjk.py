"""Along which way two convex bodies that are apart are nearest, by the method of Gilbert, Johnson
and Keerthi (1988): the point nearest to the origin of the Minkowski difference, here of
c - scale (a + b), as all our shapes are symmetric about their centres.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from .shapes import support

STEPS = 60
"""After which the best direction so far must do; 5 to 20 are usual, most where rims meet."""

Direction = tuple[int, float, float, float]
"""Corners of the simplex in use, and the unit vector from b to a."""


@compiled
def nearest_direction(kind_a: int, size_a: np.ndarray, ra: np.ndarray, kind_b: int,
                      size_b: np.ndarray, rb: np.ndarray, cx: float, cy: float, cz: float,
                      scale: float, close: float, points: np.ndarray, count: int, nx: float,
                      ny: float, nz: float) -> Direction:
    """Unit vector from b to a between the nearest points of bodies drawn at ``scale``.

    c is the way from b's centre to a's; ``close`` what part of the distance may be wrong. n is
    where to begin, with the ``count`` corners that an earlier call left in ``points`` (4, 6): the
    first half of a row is the corner, the second what it is made of, which holds for any c.
    """
    square, vx, vy, vz = math.inf, nx, ny, nz
    for k in range(count):
        for e in range(3):
            points[k, e] = (cx if e == 0 else cy if e == 1 else cz) - scale * points[k, 3 + e]
    for step in range(STEPS):
        if step > 0 or count == 0:
            ax, ay, az = support(kind_a, size_a, ra, nx, ny, nz)
            bx, by, bz = support(kind_b, size_b, rb, nx, ny, nz)
            ax, ay, az = ax + bx, ay + by, az + bz
            x, y, z = cx - scale * ax, cy - scale * ay, cz - scale * az
            if step > 0 and square - (vx * x + vy * y + vz * z) <= close * square:
                break
            row = points[count]
            row[0], row[1], row[2], row[3], row[4], row[5] = x, y, z, ax, ay, az
            count += 1
        count, x, y, z = _nearest(points, count)
        now = x * x + y * y + z * z
        if now >= square or now <= 0:
            break
        square, vx, vy, vz = now, x, y, z
        length = math.sqrt(square)
        nx, ny, nz = vx / length, vy / length, vz / length
    return count, nx, ny, nz


@compiled
def _nearest(points: np.ndarray, count: int) -> tuple[int, float, float, float]:
    """The point of a simplex that is nearest to the origin; keeps the corners that it is made of.

    The tetrahedron's is the nearest of its faces', as the origin is outside, and not on the one
    without the last corner, which came as it was nearer.
    """
    if count == 1:
        return 1, points[0, 0], points[0, 1], points[0, 2]
    last = count - 1
    if count == 2:
        square, x, y, z, kept = _on_segment(points, last - 1, last)
    else:
        square, x, y, z, kept = _on_triangle(points, last - 2, last - 1, last)
    for k in range(1, count - 1 if count == 4 else 1):
        found, a, b, c, these = _on_triangle(points, last - 3, k, last)
        if found < square:
            square, x, y, z, kept = found, a, b, c, these
    number = 0
    for k in range(count):
        if kept & (1 << k):
            for e in range(6):
                points[number, e] = points[k, e]
            number += 1
    return number, x, y, z


Nearest = tuple[float, float, float, float, int]
"""Square of the distance from the origin, the point, and the corners it stands on, a bit each."""


@compiled
def _on_segment(points: np.ndarray, i: int, j: int) -> Nearest:
    ax, ay, az = points[i, 0], points[i, 1], points[i, 2]
    px, py, pz = points[j, 0] - ax, points[j, 1] - ay, points[j, 2] - az
    along, square = -(ax * px + ay * py + az * pz), px * px + py * py + pz * pz
    kept = (1 << i) | (1 << j)
    if along <= 0:
        t, kept = 0.0, 1 << i
    elif along >= square:
        t, kept = 1.0, 1 << j
    else:
        t = along / square
    x, y, z = ax + t * px, ay + t * py, az + t * pz
    return x * x + y * y + z * z, x, y, z, kept


@compiled
def _on_triangle(points: np.ndarray, i: int, j: int, m: int) -> Nearest:
    """Within, it lies along the normal, which from differences keeps its digits in slivers too."""
    ax, ay, az = points[i, 0], points[i, 1], points[i, 2]
    bx, by, bz = points[j, 0], points[j, 1], points[j, 2]
    cx, cy, cz = points[m, 0], points[m, 1], points[m, 2]
    nx, ny, nz = cross(bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az)
    square = nx * nx + ny * ny + nz * nz
    if square > 0 and _turns(nx, ny, nz, ax, ay, az, bx, by, bz) and _turns(
            nx, ny, nz, bx, by, bz, cx, cy, cz) and _turns(nx, ny, nz, cx, cy, cz, ax, ay, az):
        t = (ax * nx + ay * ny + az * nz) / square
        return t * t * square, t * nx, t * ny, t * nz, (1 << i) | (1 << j) | (1 << m)
    best = _on_segment(points, i, j)
    other = _on_segment(points, j, m)
    if other[0] < best[0]:
        best = other
    other = _on_segment(points, i, m)
    if other[0] < best[0]:
        best = other
    return best


@compiled
def _turns(nx: float, ny: float, nz: float, ax: float, ay: float, az: float, bx: float, by: float,
           bz: float) -> bool:
    """Whether the origin lies on the inner side of the edge a b of a triangle with normal n."""
    x, y, z = cross(ax, ay, az, bx - ax, by - ay, bz - az)
    return nx * x + ny * y + nz * z > 0


@compiled
def cross(ax: float, ay: float, az: float, bx: float, by: float,
          bz: float) -> tuple[float, float, float]:
    """Cross product of two vectors."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
