"""Contacts of boxes and cylinders with each other: where what they show lies over each other.

The outline of one is clipped by the sides of that which lies square to the axis n. All is seen and
measured along n, not along the face's normal, so that the deepest contact is as deep as the bodies
are. Where nothing lies square, two lines touch, or a corner or rim touches.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from .axes import BIAS, BIAS_PART, Axis, best_axis, refined
from .clip import ROOM, clip, merge, spread
from .outline import CORNERS, SQUARE, line, outline, squareness
from .shapes import BOX, CYLINDER, bound, support

STRAIGHT = math.sqrt(1 - SQUARE * SQUARE)

SIDE_BY_SIDE = 1e-3
"""Sine between two lines up to which they touch at two points, not at one."""

MERGED = 1e-3
"""Points that are nearer to each other than this part of the smaller body's size are one."""

ALIKE = 1e-10
"""Faces whose cosines differ by less do not differ: a is the reference, or else a box."""

AGREED = 1e-10
"""m: by how much the deepest contact may differ from the depth of the bodies, where the axis is not
that of a face; where it is, it may be as far from the best as the bias allows."""

TOUCH = 2 * CORNERS * 2 * CORNERS - 1
"""Name of the contact at the nearest points, which no two sides of outlines have."""


@compiled
def _axis(kind_a: int, size_a: np.ndarray, ra: np.ndarray, kind_b: int, size_b: np.ndarray,
          rb: np.ndarray, cx: float, cy: float, cz: float, margin: float) -> Axis:
    """The axis to touch along: a face's unless another is clearly better."""
    s, x, y, z = best_axis(kind_a, size_a, ra, kind_b, size_b, rb, cx, cy, cz, 1.0, margin)
    if s <= margin and (kind_a == CYLINDER or kind_b == CYLINDER):
        t, a, b, c = refined(kind_a, size_a, ra, kind_b, size_b, rb, cx, cy, cz, s, x, y, z)
        if t > s + BIAS + BIAS_PART * abs(s):
            return t, a, b, c
    return s, x, y, z


@compiled
def flat_contacts(kind_a: int, size_a: np.ndarray, pa: np.ndarray, ra: np.ndarray, kind_b: int,
                  size_b: np.ndarray, pb: np.ndarray, rb: np.ndarray, margin: float,
                  out: np.ndarray) -> int:
    """Contacts of two bodies that are boxes or cylinders."""
    cx, cy, cz = pa[0] - pb[0], pa[1] - pb[1], pa[2] - pb[2]
    s, x, y, z = _axis(kind_a, size_a, ra, kind_b, size_b, rb, cx, cy, cz, margin)
    if s > margin:
        return 0
    work = np.empty((2 * ROOM + CORNERS, 5))
    found, corners = work[ROOM:2 * ROOM], work[2 * ROOM:]
    face_a, face_b = squareness(kind_a, ra, x, y, z), squareness(kind_b, rb, x, y, z)
    square = max(face_a, face_b)
    exact = square > 1 - ALIKE
    # what is clipped is drawn first, the reference second
    first, second = (kind_b, size_b, rb, 0.0, 0.0, 0.0), (kind_a, size_a, ra, cx, cy, cz)
    sign = -1.0
    if face_b > face_a + (ALIKE if kind_a == BOX else -ALIKE):
        first, second, sign = second, first, 1.0
    if square >= STRAIGHT:
        count = _faces(*first, *second, x, y, z, sign, work[:ROOM], found, corners)
    else:
        count = _lines(kind_a, size_a, ra, kind_b, size_b, rb, cx, cy, cz, x, y, z, found)
    least = math.inf
    for i in range(count):
        least = min(least, found[i, 4])
    if least > s + (BIAS + BIAS_PART * abs(s) if exact else AGREED):
        if exact:
            _corner(*first, s, x, y, z, sign, found[count])
        else:
            _crossing(kind_a, size_a, ra, kind_b, size_b, rb, cx, cy, cz, s, x, y, z, found[count])
        count += 1
    apart = MERGED * min(bound(kind_a, size_a), bound(kind_b, size_b))
    count = merge(found, count, margin, apart)
    count = spread(found, count)
    for i in range(count):
        row, point = out[i], found[i]
        for e in range(3):
            row[e] = pb[e] + point[e]
        row[3], row[4], row[5], row[6], row[7] = x, y, z, point[4], point[3]
    return count


@compiled
def _faces(other_kind: int, other_size: np.ndarray, other_r: np.ndarray, ox: float, oy: float,
           oz: float, kind: int, size: np.ndarray, r: np.ndarray, cx: float, cy: float, cz: float,
           nx: float, ny: float, nz: float, sign: float, rows: np.ndarray, found: np.ndarray,
           corners: np.ndarray) -> int:
    """Clip what the other body shows by this one's face; ``sign`` is 1 if n leaves this one.

    c and o are the centres from b's. Rows (k, 5) of ``found``: place, name, gap.
    """
    tx, ty, tz = support(other_kind, other_size, other_r, -sign * nx, -sign * ny, -sign * nz)
    number, cut = outline(other_kind, other_size, other_r, -sign * nx, -sign * ny, -sign * nz,
                          0.0, 0.0, 0.0, rows)
    count, face = outline(kind, size, r, sign * nx, sign * ny, sign * nz,
                          ox + tx - cx, oy + ty - cy, oz + tz - cz, corners)
    for i in range(number):
        rows[i, 0] += ox - cx
        rows[i, 1] += oy - cy
        rows[i, 2] += oz - cz
        rows[i, 3] = i
    qx, qy, qz = corners[0, 0], corners[0, 1], corners[0, 2]
    axis = face // 2 if kind == BOX else 2
    fx, fy, fz = r[0, axis], r[1, axis], r[2, axis]
    number, first = clip(corners, count, nx, ny, nz, rows, number, found)
    if not first:
        for i in range(number):
            for e in range(4):
                rows[i, e] = found[i, e]
    steep = fx * nx + fy * ny + fz * nz
    pair = ((6 if sign > 0 else 0) + face) * 6 + cut
    for i in range(number):
        row, side = rows[i], rows[i - 1 if i > 0 else number - 1, 3]
        height = (fx * (row[0] - qx) + fy * (row[1] - qy) + fz * (row[2] - qz)) / steep
        found[i, 0] = cx + row[0] - nx * height / 2
        found[i, 1] = cy + row[1] - ny * height / 2
        found[i, 2] = cz + row[2] - nz * height / 2
        found[i, 3] = (pair * 2 * CORNERS + side) * 2 * CORNERS + row[3]
        found[i, 4] = sign * height
    return number


@compiled
def _lines(kind_a: int, size_a: np.ndarray, ra: np.ndarray, kind_b: int, size_b: np.ndarray,
           rb: np.ndarray, cx: float, cy: float, cz: float, nx: float, ny: float,
           nz: float, found: np.ndarray) -> int:
    """The ends of what two lines side by side have in common, seen along n; 0 if they cross."""
    ax, ay, az, ux, uy, uz = line(kind_a, size_a, ra, -nx, -ny, -nz)
    bx, by, bz, vx, vy, vz = line(kind_b, size_b, rb, nx, ny, nz)
    ax, ay, az = ax + cx - bx, ay + cy - by, az + cz - bz
    rise, other_rise = ux * nx + uy * ny + uz * nz, vx * nx + vy * ny + vz * nz
    uu, vv = ux * ux + uy * uy + uz * uz - rise * rise, (
        vx * vx + vy * vy + vz * vz - other_rise * other_rise)
    uv = ux * vx + uy * vy + uz * vz - rise * other_rise
    if uu <= 0 or vv <= 0 or uu * vv - uv * uv > SIDE_BY_SIDE * SIDE_BY_SIDE * uu * vv:
        return 0
    height = ax * nx + ay * ny + az * nz
    av = ax * vx + ay * vy + az * vz - height * other_rise
    # a's points a + t u lie over b's at (av + t uv) / vv of v
    ends = (vv - av) / uv, (-vv - av) / uv
    lo, hi = max(min(ends[0], ends[1]), -1.0), min(max(ends[0], ends[1]), 1.0)
    if lo > hi:
        return 0
    for k in range(2):
        t = lo if k == 0 else hi
        gap = height + t * rise - (av + t * uv) / vv * other_rise
        found[k, 0] = bx + ax + t * ux - nx * gap / 2
        found[k, 1] = by + ay + t * uy - ny * gap / 2
        found[k, 2] = bz + az + t * uz - nz * gap / 2
        found[k, 3], found[k, 4] = k, gap
    return 2


@compiled
def _corner(kind: int, size: np.ndarray, r: np.ndarray, cx: float, cy: float, cz: float, s: float,
            nx: float, ny: float, nz: float, sign: float, row: np.ndarray) -> None:
    """The one contact of a corner or rim with a face from which n goes to it, times ``sign``."""
    x, y, z = support(kind, size, r, -sign * nx, -sign * ny, -sign * nz)
    half = sign * s / 2
    row[0], row[1], row[2] = cx + x - half * nx, cy + y - half * ny, cz + z - half * nz
    row[3], row[4] = TOUCH, s


@compiled
def _crossing(kind_a: int, size_a: np.ndarray, ra: np.ndarray, kind_b: int, size_b: np.ndarray,
              rb: np.ndarray, cx: float, cy: float, cz: float, s: float, nx: float, ny: float,
              nz: float, row: np.ndarray) -> None:
    """The one contact of two lines that cross, or of a corner or rim with a line."""
    ax, ay, az, ux, uy, uz = line(kind_a, size_a, ra, -nx, -ny, -nz)
    bx, by, bz, vx, vy, vz = line(kind_b, size_b, rb, nx, ny, nz)
    ax, ay, az = ax + cx, ay + cy, az + cz
    dx, dy, dz = bx - ax, by - ay, bz - az
    rise, other_rise = ux * nx + uy * ny + uz * nz, vx * nx + vy * ny + vz * nz
    apart = dx * nx + dy * ny + dz * nz
    uu, vv = ux * ux + uy * uy + uz * uz - rise * rise, (
        vx * vx + vy * vy + vz * vz - other_rise * other_rise)
    uv = ux * vx + uy * vy + uz * vz - rise * other_rise
    du = dx * ux + dy * uy + dz * uz - apart * rise
    dv = dx * vx + dy * vy + dz * vz - apart * other_rise
    t = 0.0
    if uu > 0 and vv > 0:
        # the closest points of two segments, seen along n: Ericson 5.1.9
        square = uu * vv - uv * uv
        t = (du * vv - dv * uv) / square if square > 1e-12 * uu * vv else 0.0
        t = min(max(t, -1.0), 1.0)
        e = min(max((t * uv - dv) / vv, -1.0), 1.0)
        t = min(max((du + e * uv) / uu, -1.0), 1.0)
    if uu > 0 and vv <= 0:
        x, y, z, half = bx, by, bz, s / 2
    else:
        x, y, z, half = ax + t * ux, ay + t * uy, az + t * uz, -s / 2
    row[0], row[1], row[2] = x + half * nx, y + half * ny, z + half * nz
    row[3], row[4] = TOUCH, s
