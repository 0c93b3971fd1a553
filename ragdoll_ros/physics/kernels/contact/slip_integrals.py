"""Integrals over a patch that turns about a center: what Coulomb's friction at all its points adds
up to.

With y from the center, friction opposes the slip, which is across y: its sum under a pressure p is
the integral of p y/|y|, turned by a right angle, and its moment about the center that of p |y|. The
integrands are homogeneous in y, so those over an area are integrals along its boundary,

    integral of f dA = 1 / (k + 2) * integral of f (y x dl),   f of degree k,

along straight edges in closed form. ``Sums``: integrals over the boundary, or over a segment
itself, of y/|y| (2), of y y^T/|y| (xx, xy, yy), of |y| and of y |y| (2), over its area or length.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..maths.transcendental import asinh

Sums = tuple[float, float, float, float, float, float, float, float]
Moments = tuple[float, float, float, float, float, float, float, float, float]

NO_SUMS = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

COSINES = (1.0, math.sqrt(0.75), 0.5, 0.0, -0.5, -math.sqrt(0.75), -1.0, -math.sqrt(0.75), -0.5,
           0.0, 0.5, math.sqrt(0.75))
"""Of twelve points of a circle, thirty degrees apart: the trapezoidal rule errs by 1e-3, and where
the center is near the circle by 4e-3."""


@compiled
def add_sums(sums: Sums, share: float, a: Sums) -> Sums:
    """The sums, and ``share`` times others."""
    return (sums[0] + share * a[0], sums[1] + share * a[1], sums[2] + share * a[2],
            sums[3] + share * a[3], sums[4] + share * a[4], sums[5] + share * a[5],
            sums[6] + share * a[6], sums[7] + share * a[7])


@compiled
def edge_sums(ax: float, ay: float, bx: float, by: float) -> Sums:
    """Return the integrals listed at Sums, in that order, along the straight line from a to b, m,
    both relative to the center of rotation; not divided by an area or length.
    """
    ex, ey = bx - ax, by - ay
    length = math.sqrt(ex * ex + ey * ey)
    if length == 0.0:
        return NO_SUMS
    ex, ey = ex / length, ey / length
    start, end, height = ax * ex + ay * ey, bx * ex + by * ey, ay * ex - ax * ey
    near, far = math.sqrt(ax * ax + ay * ay), math.sqrt(bx * bx + by * by)
    wide = (near + far) * (near + far) - length * length
    inverse = 2 * asinh(length / math.sqrt(wide)) if wide > 1e-20 * length * length else 0.0
    rise, product = far - near, end * far - start * near
    lying, upright = rise, height * inverse
    lengthwise, both = (product - height * upright) / 2, height * rise
    across, mean = height * upright, (product + height * upright) / 2
    third, high = (far * far * far - near * near * near) / 3, height * mean
    nx, ny = -ey, ex
    return (lying * ex + upright * nx, lying * ey + upright * ny,
            lengthwise * ex * ex + 2 * both * ex * nx + across * nx * nx,
            lengthwise * ex * ey + both * (ex * ny + ey * nx) + across * nx * ny,
            lengthwise * ey * ey + 2 * both * ey * ny + across * ny * ny,
            mean, third * ex + high * nx, third * ey + high * ny)


@compiled
def segment_moments(ex: float, ey: float, x: float, y: float) -> Moments:
    """Moments of the segment from -e to e, of length 2 |e|, about the center (x, y)."""
    share = 0.5 / math.sqrt(ex * ex + ey * ey)
    sums = add_sums(NO_SUMS, share, edge_sums(-ex - x, -ey - y, ex - x, ey - y))
    return moments(sums, x, y, 0)


@compiled
def disc_moments(radius: float, x: float, y: float) -> Moments:
    """Moments of the disc about the center of rotation (x, y), by twelve points: see COSINES."""
    sums = NO_SUMS
    for k in range(12):
        c, s = COSINES[k], COSINES[k - 3 if k >= 3 else k + 9]
        a, b = radius * c - x, radius * s - y
        far = max(math.sqrt(a * a + b * b), 1e-9 * radius)
        share = (1 - (x * c + y * s) / radius) / (6 * far)
        sums = add_sums(sums, share, (a, b, a * a, a * b, b * b, far * far, a * far * far,
                                      b * far * far))
    return moments(sums, x, y, 2)


@compiled
def polygon_moments(u: np.ndarray, v: np.ndarray, count: int, area: float, x: float,
                    y: float) -> Moments:
    """Moments of the polygon with these corners, counterclockwise, about the center (x, y)."""
    sums = NO_SUMS
    for k in range(count):
        j = k + 1 if k + 1 < count else 0
        ax, ay, bx, by = u[k] - x, v[k] - y, u[j] - x, v[j] - y
        ex, ey = bx - ax, by - ay
        length = math.sqrt(ex * ex + ey * ey)
        if length > 0.0:
            sums = add_sums(sums, (ax * by - ay * bx) / (length * area), edge_sums(ax, ay, bx, by))
    return moments(sums, x, y, 2)


@compiled
def moments(sums: Sums, x: float, y: float, dimensions: int) -> Moments:
    """Return Moments: the means over a patch of y/|y| (2), of y/|y| times the first coordinate (2)
    and times the second (2), of |y| (1), and of |y| times both coordinates (2), where y is relative
    to the center of rotation; the coordinates, and the center (x, y), to the patch's own origin.
    ``sums``: Sums, divided by the patch's area or length. ``dimensions``: 2 if they are over the
    boundary of an area, 0 if over the patch itself.
    """
    none, one, two = (1.0, 1.0, 1.0) if dimensions == 0 else (1 / 2, 1 / 3, 1 / 4)
    jx, jy, m = none * sums[0], none * sums[1], one * sums[5]
    return (jx, jy, x * jx + one * sums[2], x * jy + one * sums[3], y * jx + one * sums[3],
            y * jy + one * sums[4], m, x * m + two * sums[6], y * m + two * sums[7])
