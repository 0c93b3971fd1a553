"""Face of a contact patch: its center, moments of inertia and the part that is pressed.

The pressure that belongs to the normal forces at the corners is affine over the face, or, where
their center is too far from the middle for that, over a smaller copy of the face at its edge.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..dynamics.kinematics import Kinematics
from ..maths.vectors import Vec3, add_scaled, vec
from ..system import System
from ..workspace import Contacts
from .find_contacts import cylinder_of_patch, face_center
from .patch import DEGENERATE, sort_corners
from .slip_integrals import Moments, disc_moments, polygon_moments, segment_moments

SMALLEST = 0.01
"""Least size of the pressed part of a face, over the face's."""

SEGMENT, DISC, POLYGON = 0, 1, 2

Face = tuple[int, float, float, float, float, float, float]
"""Kind; half the vector along a segment, or the radius of a disc, or the area of a polygon, and 0;
the inverse (xx, xy, yy) of the mean of x x^T over it; root of the mean square of the distance from
its center over that of its corners. Corners, from the center: in contacts.u and contacts.v."""


@compiled
def measure_face(s: System, contacts: Contacts, kin: Kinematics, begin: int, end: int,
                 middle: Vec3) -> tuple[Vec3, Face]:
    """Return the center, m, world, and the Face of the patch of contacts begin to end - 1: a disc,
    a polygon, or a segment if its area is close to 0. ``middle``: mean of their points, m. The
    center is the centroid. Except of a disc, writes the corners from the centroid, m, to contacts.u
    and v.
    """
    found, count, u, v = contacts.found, end - begin, contacts.u, contacts.v
    first = found[begin]
    disc = cylinder_of_patch(s, first.patch) if count > 2 else -1
    if disc >= 0:
        radius = s.geoms[disc].size[0]
        spread = 4 / (radius * radius)
        return (face_center(s.geoms[disc], disc, kin, first),
                (DISC, radius, 0.0, spread, 0.0, spread, math.sqrt(0.5)))
    corners = sort_corners(contacts, begin, end, middle)
    area = x = y = xx = xy = yy = 0.0
    for k in range(count):
        j = k + 1 if k + 1 < count else 0
        part = max(0.0, u[k] * v[j] - v[k] * u[j]) / 2
        area += part
        x, y = x + part * (u[k] + u[j]) / 3, y + part * (v[k] + v[j]) / 3
        xx += part * (u[k] * u[k] + u[j] * u[j] + u[k] * u[j]) / 6
        xy += part * (u[k] * v[k] + u[j] * v[j] + (u[k] * v[j] + u[j] * v[k]) / 2) / 6
        yy += part * (v[k] * v[k] + v[j] * v[j] + v[k] * v[j]) / 6
    if not area > DEGENERATE * corners * corners:
        return measure_segment(first, count, middle, u, v)
    x, y, xx, xy, yy = x / area, y / area, xx / area, xy / area, yy / area
    xx, xy, yy, square = xx - x * x, xy - x * y, yy - y * y, 0.0
    for k in range(count):
        u[k], v[k] = u[k] - x, v[k] - y
        square += (u[k] * u[k] + v[k] * v[k]) / count
    det = xx * yy - xy * xy
    center = add_scaled(add_scaled(middle, x, vec(first.tangents[0])), y, vec(first.tangents[1]))
    return center, (POLYGON, area, 0.0, yy / det, -xy / det, xx / det,
                    math.sqrt((xx + yy) / square))


@compiled
def measure_segment(c: np.record, count: int, middle: Vec3, u: np.ndarray,
                    v: np.ndarray) -> tuple[Vec3, Face]:
    """Return the center, m, world, and the Face of a patch whose ``count`` points are on a line:
    half the vector of the segment that they span, and the pseudo-inverse of its second moments,
    1/m^2. ``u``, ``v``: coordinates of the points along c.tangents from ``middle``, m; their first
    two entries become the ends of the segment, from its center.
    """
    far = 0
    for k in range(count):
        if u[k] * u[k] + v[k] * v[k] > u[far] * u[far] + v[far] * v[far]:
            far = k
    x, y = u[far], v[far]
    square, least = x * x + y * y, 0.0
    for k in range(count):
        least = min(least, (u[k] * x + v[k] * y) / square)
    offset, half = (1 + least) / 2, (1 - least) / 2
    center = add_scaled(add_scaled(middle, offset * x, vec(c.tangents[0])), offset * y,
                        vec(c.tangents[1]))
    x, y = half * x, half * y
    u[0], v[0], u[1], v[1] = x, y, -x, -y
    spread = 3 / (half * half * square * half * half * square)
    return center, (SEGMENT, x, y, spread * x * x, spread * x * y, spread * y * y,
                    math.sqrt(1 / 3))


@compiled
def pressed_part(contacts: Contacts, count: int, face: Face, px: float,
                 py: float) -> tuple[float, float, float]:
    """Part of the face that carries a pressure with the center (px, py), m, without tension.

    The part is a scaled copy of the face, over which an affine pressure with that center is nowhere
    negative, unless its scale would be below SMALLEST. Returns its scale, SMALLEST to 1, and its
    centroid; 1 and (0, 0) for the whole face. Centers and centroid: m, from the face's center.
    """
    u, v = contacts.u, contacts.v
    if face[0] == DISC:
        out = math.sqrt(px * px + py * py) / face[1]
        tilt = 4 * out
    else:
        gx, gy = face[3] * px + face[4] * py, face[4] * px + face[5] * py
        out = tilt = 0.0
        for k in range(2 if face[0] == SEGMENT else count):
            tilt = max(tilt, -(gx * u[k] + gy * v[k]))
            j = k + 1 if k + 1 < count else 0
            nx, ny = v[j] - v[k], u[k] - u[j]
            height = nx * u[k] + ny * v[k]
            if height > 0.0:
                out = max(out, (nx * px + ny * py) / height)
        if face[0] == SEGMENT:
            out = tilt / 3
    if not tilt > 1.0:
        return 1.0, 0.0, 0.0
    share = max(SMALLEST, (1 / out - 1) / (1 / out - 1 / tilt))
    return share, (1 - share) * px / out, (1 - share) * py / out


@compiled
def face_moments(contacts: Contacts, count: int, face: Face, x: float, y: float) -> Moments:
    """Return the Moments of a face, see slip_integrals.moments(). (x, y): center of rotation, m,
    from the face's center. A polygon's ``count`` corners: contacts.u and v.
    """
    if face[0] == DISC:
        return disc_moments(face[1], x, y)
    if face[0] == SEGMENT:
        return segment_moments(face[1], face[2], x, y)
    return polygon_moments(contacts.u, contacts.v, count, face[1], x, y)


@compiled
def resultant_and_moment(face: Face, moments: Moments, px: float,
                         py: float) -> tuple[float, float, float]:
    """Return the means over a face, weighted by an affine pressure, of y/|y|, two numbers, and of
    |y|, m, where y is the position relative to the center of rotation, about which ``moments`` are.
    (px, py): center of pressure relative to that of the face, m.

    Times friction coefficient and normal force, the first mean, turned by 90 degrees against the
    rotation, is the friction force of a turning patch; the second is its moment about the center of
    rotation.
    """
    gx, gy = face[3] * px + face[4] * py, face[4] * px + face[5] * py
    return (moments[0] + gx * moments[2] + gy * moments[4],
            moments[1] + gx * moments[3] + gy * moments[5],
            max(0.0, moments[6] + gx * moments[7] + gy * moments[8]))
