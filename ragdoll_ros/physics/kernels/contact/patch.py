"""Where the friction of a patch acts as that of its whole face would."""
from __future__ import annotations

import math

from ..compiling.decorators import compiled
from ..maths.transcendental import asinh
from ..system import Workspace

SEGMENT = 0.5
"""Mean distance of a segment's points from its middle over that of its ends."""


@compiled
def contract_friction_points(r: Workspace, begin: int, end: int) -> None:
    """Draw the arms of one patch towards the middle by the ratio of the mean distances."""
    contacts, count = r.contacts, end - begin
    x = y = z = 0.0
    for e in range(begin, end):
        p = contacts[e].point
        x, y, z = x + p[0] / count, y + p[1] / count, z + p[2] / count
    t, w = contacts[begin].tangents[0], contacts[begin].tangents[1]
    flat = r.solver  # room for angle, and the place along t and w, in the order of the angles
    corners = 0.0
    for e in range(begin, end):
        p = contacts[e].point
        a, b, c = p[0] - x, p[1] - y, p[2] - z
        u, v = a * t[0] + b * t[1] + c * t[2], a * w[0] + b * w[1] + c * w[2]
        corners += math.sqrt(u * u + v * v) / count
        angle, k = motion_bound(u, v), e - begin
        while k > 0 and flat[0, k - 1] > angle:
            flat[0, k], flat[1, k], flat[2, k] = flat[0, k - 1], flat[1, k - 1], flat[2, k - 1]
            k -= 1
        flat[0, k], flat[1, k], flat[2, k] = angle, u, v
    area = moment = 0.0
    for k in range(count):
        j = (k + 1) % count
        part, mean = triangle(flat[1, k], flat[2, k], flat[1, j], flat[2, j])
        area, moment = area + part, moment + mean
    share = SEGMENT
    if area > 1e-3 * corners * corners:
        share = min(1.0, moment / area / corners)
    elif corners == 0.0:
        share = 1.0
    for e in range(begin, end):
        c = contacts[e]
        c.friction_point[0] = x + share * (c.point[0] - x)
        c.friction_point[1] = y + share * (c.point[1] - y)
        c.friction_point[2] = z + share * (c.point[2] - z)


@compiled
def motion_bound(x: float, y: float) -> float:
    """What orders directions as their angle does: -2 to 2 for -pi to pi."""
    size = abs(x) + abs(y)
    return math.copysign(1 - x / size, y) if size > 0.0 else 0.0


@compiled
def triangle(ax: float, ay: float, bx: float, by: float) -> tuple[float, float]:
    """Area of the triangle of the origin, a and b, and the integral over it of the distance from
    the origin: d^3/6 (sec tan + ln(sec + tan)) from foot to corner, d the height of the side ab.
    """
    area = (ax * by - ay * bx) / 2
    side = math.sqrt((bx - ax) ** 2 + (by - ay) ** 2)
    if not area > 0.0 or side == 0.0:
        return 0.0, 0.0
    height = 2 * area / side
    along = (bx * (bx - ax) + by * (by - ay)) / side
    before = (ax * (bx - ax) + ay * (by - ay)) / side
    return area, height ** 3 / 6 * (sector(along / height) - sector(before / height))


@compiled
def sector(tangent: float) -> float:
    """The sum sec tan + ln(sec + tan) of the angle of that tangent."""
    return tangent * math.sqrt(1 + tangent * tangent) + asinh(tangent)
