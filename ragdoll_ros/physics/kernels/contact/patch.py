"""Friction points of a contact patch, so that its friction against turning about its middle is that
of its whole area; those of a patch that slips: patch_friction.py.
"""
from __future__ import annotations

import math

from ..compiling.decorators import compiled
from ..maths.transcendental import asinh
from ..maths.vectors import add, add_scaled, divide, dot, put, sub, vec
from ..workspace import Contacts

SEGMENT_MEAN = 0.5
"""Mean distance of a segment's points from its center, over that of its ends."""

DEGENERATE = 1e-3
"""Area of a patch over the square of its corners' mean distance, below which it is a segment."""


@compiled
def contract_friction_points(contacts: Contacts, begin: int, end: int) -> None:
    """Write the friction points of contacts begin to end - 1, a patch. Each is the contact's point,
    moved towards the mean of all points: its distance is multiplied by (mean distance of the
    patch's area from the mean) / (mean distance of the corners from it), at most 1; SEGMENT_MEAN
    for a segment. Overwrites contacts.angles, u and v.
    """
    found, count = contacts.found, end - begin
    center = 0.0, 0.0, 0.0
    for e in range(begin, end):
        center = add(center, divide(vec(found[e].point), count))
    corners = sort_corners(contacts, begin, end, center)
    area = moment = 0.0
    for k in range(count):
        j = (k + 1) % count
        part, mean = triangle_moment(contacts.u[k], contacts.v[k], contacts.u[j], contacts.v[j])
        area, moment = area + part, moment + mean
    share = SEGMENT_MEAN
    if area > DEGENERATE * corners * corners:
        share = min(1.0, moment / area / corners)
    elif corners == 0.0:
        share = 1.0
    for e in range(begin, end):
        c = found[e]
        put(c.friction_point, add_scaled(center, share, sub(vec(c.point), center)))


@compiled
def sort_corners(contacts: Contacts, begin: int, end: int,
                 center: tuple[float, float, float]) -> float:
    """Write the points of a patch from its center along its tangents, m, to contacts.u and
    contacts.v, sorted by angle. Returns their mean distance from the center, m.
    """
    found, angles, us, vs = contacts.found, contacts.angles, contacts.u, contacts.v
    t, w, corners = vec(found[begin].tangents[0]), vec(found[begin].tangents[1]), 0.0
    for e in range(begin, end):
        arm = sub(vec(found[e].point), center)
        u, v = dot(arm, t), dot(arm, w)
        corners += math.sqrt(u * u + v * v) / (end - begin)
        angle, k = pseudo_angle(u, v), e - begin
        while k > 0 and angles[k - 1] > angle:
            angles[k], us[k], vs[k] = angles[k - 1], us[k - 1], vs[k - 1]
            k -= 1
        angles[k], us[k], vs[k] = angle, u, v
    return corners


@compiled
def pseudo_angle(x: float, y: float) -> float:
    """A number from -2 to 2 that grows with the angle of (x, y) from -pi to pi."""
    size = abs(x) + abs(y)
    return math.copysign(1 - x / size, y) if size > 0.0 else 0.0


@compiled
def triangle_moment(ax: float, ay: float, bx: float, by: float) -> tuple[float, float]:
    """Area, m^2, of the triangle of the origin, a and b, and the integral over it of the distance
    from the origin, m^3: d^3/6 (sec tan + ln(sec + tan)) between a and b, d the height of the side
    ab. Both are 0 unless the corners are counterclockwise.
    """
    area = (ax * by - ay * bx) / 2
    side = math.sqrt((bx - ax) ** 2 + (by - ay) ** 2)
    if not area > 0.0 or side == 0.0:
        return 0.0, 0.0
    height = 2 * area / side
    end = (bx * (bx - ax) + by * (by - ay)) / side
    start = (ax * (bx - ax) + ay * (by - ay)) / side
    return area, height ** 3 / 6 * (secant_integral(end / height)
                                    - secant_integral(start / height))


@compiled
def secant_integral(tangent: float) -> float:
    """The sum sec tan + ln(sec + tan) of the angle with this tangent."""
    return tangent * math.sqrt(1 + tangent * tangent) + asinh(tangent)
