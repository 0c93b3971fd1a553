"""Along which way two convex bodies that are apart are nearest, by the method of Gilbert, Johnson
and Keerthi (1988): the point nearest to the origin of the Minkowski difference, here of
c - scale (a + b), as all our shapes are symmetric about their centres.
"""
from __future__ import annotations

import math

import numpy as np

from .collision_shapes import compiled, support

CLOSE = 1e-10
"""Of the distance: what it may be wrong by."""


@compiled
def nearest_direction(kind_a: int, size_a: np.ndarray, ra: np.ndarray, kind_b: int,
                      size_b: np.ndarray, rb: np.ndarray, cx: float, cy: float, cz: float,
                      scale: float, nx: float, ny: float, nz: float,
                      points: np.ndarray) -> tuple[float, float, float]:
    """Unit vector from b to a between the nearest points of bodies drawn at ``scale``.

    c is the way from b's centre to a's; n is where to begin. ``points`` (4, 3) is room to work in.
    """
    count, square = 0, math.inf
    vx, vy, vz = nx, ny, nz
    for _ in range(60):
        ax, ay, az = support(kind_a, size_a, ra, nx, ny, nz)
        bx, by, bz = support(kind_b, size_b, rb, nx, ny, nz)
        x, y, z = cx - scale * (ax + bx), cy - scale * (ay + by), cz - scale * (az + bz)
        if count > 0 and square - (vx * x + vy * y + vz * z) <= CLOSE * square:
            break
        points[count, 0], points[count, 1], points[count, 2] = x, y, z
        count, x, y, z = _nearest(points, count + 1)
        now = x * x + y * y + z * z
        if now >= square or now <= 0:
            break
        square, vx, vy, vz = now, x, y, z
        length = math.sqrt(square)
        nx, ny, nz = vx / length, vy / length, vz / length
    return nx, ny, nz


@compiled
def _nearest(points: np.ndarray, count: int) -> tuple[int, float, float, float]:
    """The point of a simplex that is nearest to the origin; keeps the corners that it is made of.

    The tetrahedron's is the nearest of its faces', as the origin is outside.
    """
    if count == 1:
        return 1, points[0, 0], points[0, 1], points[0, 2]
    if count == 2:
        return _keep(points, 0, 1, 1, *_on_triangle(points, 0, 1, 1))
    if count == 3:
        return _keep(points, 0, 1, 2, *_on_triangle(points, 0, 1, 2))
    best, omitted = math.inf, 0
    for k in range(4):
        i, j, m = (1 if k == 0 else 0), (2 if k < 2 else 1), (3 if k < 3 else 2)
        a, b, c = _on_triangle(points, i, j, m)
        square = 0.0
        for e in range(3):
            square += (a * points[i, e] + b * points[j, e] + c * points[m, e]) ** 2
        if square < best:
            best, omitted = square, k
    i, j = (1 if omitted == 0 else 0), (2 if omitted < 2 else 1)
    m = 3 if omitted < 3 else 2
    return _keep(points, i, j, m, *_on_triangle(points, i, j, m))


@compiled
def _keep(points: np.ndarray, i: int, j: int, m: int, a: float, b: float,
          c: float) -> tuple[int, float, float, float]:
    """Move the corners i < j < m that have a weight to the front; gives their number and sum."""
    x = a * points[i, 0] + b * points[j, 0] + c * points[m, 0]
    y = a * points[i, 1] + b * points[j, 1] + c * points[m, 1]
    z = a * points[i, 2] + b * points[j, 2] + c * points[m, 2]
    count = 0
    for k, weight in ((i, a), (j, b), (m, c)):
        if weight > 0:
            for e in range(3):
                points[count, e] = points[k, e]
            count += 1
    return count, x, y, z


@compiled
def _on_triangle(points: np.ndarray, i: int, j: int, m: int) -> tuple[float, float, float]:
    """Weights of a triangle's corners in its point nearest to the origin; j = m: of a segment.

    Ericson, Real-Time Collision Detection (2005), section 5.1.5.
    """
    ax, ay, az = points[i, 0], points[i, 1], points[i, 2]
    bx, by, bz = points[j, 0], points[j, 1], points[j, 2]
    px, py, pz = bx - ax, by - ay, bz - az
    if j == m:
        square = px * px + py * py + pz * pz
        t = -(ax * px + ay * py + az * pz)
        t = min(max(t / square, 0.0), 1.0) if square > 0 else 0.0
        return 1 - t, t, 0.0
    cx, cy, cz = points[m, 0], points[m, 1], points[m, 2]
    qx, qy, qz = cx - ax, cy - ay, cz - az
    d1, d2 = -(px * ax + py * ay + pz * az), -(qx * ax + qy * ay + qz * az)
    if d1 <= 0 and d2 <= 0:
        return 1.0, 0.0, 0.0
    d3, d4 = -(px * bx + py * by + pz * bz), -(qx * bx + qy * by + qz * bz)
    if d3 >= 0 and d4 <= d3:
        return 0.0, 1.0, 0.0
    vc = d1 * d4 - d3 * d2
    if vc <= 0 and d1 >= 0 and d3 <= 0 and d1 > d3:
        t = d1 / (d1 - d3)
        return 1 - t, t, 0.0
    d5, d6 = -(px * cx + py * cy + pz * cz), -(qx * cx + qy * cy + qz * cz)
    if d6 >= 0 and d5 <= d6:
        return 0.0, 0.0, 1.0
    vb = d5 * d2 - d1 * d6
    if vb <= 0 and d2 >= 0 and d6 <= 0 and d2 > d6:
        t = d2 / (d2 - d6)
        return 1 - t, 0.0, t
    va = d3 * d6 - d5 * d4
    if va <= 0 and d4 >= d3 and d5 >= d6:
        t = (d4 - d3) / max((d4 - d3) + (d5 - d6), 1e-300)
        return 0.0, 1 - t, t
    total = va + vb + vc
    if total <= 0:
        return 1.0, 0.0, 0.0
    return 1 - vb / total - vc / total, vb / total, vc / total
