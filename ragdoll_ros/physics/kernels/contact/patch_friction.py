"""Friction of patches that slip, as that of all their points together; see slip_integrals.py.

A patch that slides and turns has an instantaneous center. Where the friction of its points adds up
to the share j of mu times the normal force, and has the mean lever arm m about the center, it is
that of one point in whose direction it pulls, m / j from the center, with a coefficient of j mu:
only there is the slip along the pull. Contacts get such points, and coefficients, that with their
normal impulses of the last step the friction of the patch is exact. The pressure is affine, or,
where the normal impulses are too far from the middle for that, affine over a smaller copy of the
face. Elsewhere friction points are those of find_contacts.set_friction_points(): where a patch
sticks, or its slip is not the same for two steps.
"""
from __future__ import annotations

import math

import numpy as np

from ..collision.shapes import CYLINDER
from ..compiling.decorators import compiled
from ..contact_kind import LIMIT
from ..dynamics.kinematics import Kinematics, root_position, velocity_at
from ..maths.vectors import Vec3, add, add_scaled, divide, dot, norm, put, sub, vec
from ..system import NO_SLIP, System
from ..workspace import Contacts, Workspace
from .find_contacts import face_center, patch_end
from .patch import DEGENERATE, sort_corners
from .slip_integrals import Moments, disc_moments, polygon_moments, segment_moments

STILL = 1e-4
"""m/s: slower slip may be that of what sticks."""

UNSTEADY = 0.25
"""Change of the slip in half a step, as a share of it, above which it says nothing of the next."""

FAR = 50.0
"""Distance of the center, over the size of the patch, from which on a patch merely slides."""

FLAT = 0.999
"""Least cosine between the normals of a patch."""

PULL = 0.3
"""Share of the friction that is left in sum, below which the contacts pull in several directions,
as in a patch that turns about its middle."""

LONGEST = 4.0
"""Longest lever arm of a contact's friction, over the size of the patch."""

SMALLEST = 0.01
"""Least size of the pressed part of a face, over the face's."""

SEGMENT, DISC, POLYGON = 0, 1, 2

Face = tuple[int, float, float, float, float, float, float]
"""Kind; half the vector along a segment, or the radius of a disc, or the area of a polygon, and 0;
the inverse (xx, xy, yy) of the mean of x x^T over it; root of the mean square of the distance from
its center over that of its corners. Corners, from the center: in contacts.u and contacts.v."""


@compiled
def set_slip_friction(s: System, ws: Workspace, kin: Kinematics, q: np.ndarray, m: int,
                      in_step: bool) -> None:
    """Set friction points and coefficients of those patches among m found contacts that slip at the
    velocities of ``kin``, which is that of q. ``in_step``: only where the velocities at the step's
    start, from warm_start(), hardly differ; start_velocity becomes that of the new points.
    """
    found, begin = ws.contacts.found, 0
    while begin < m:
        end = patch_end(found, begin, m)
        size = norm(sub(vec(found[begin].point), vec(found[end - 1].point))) / 2
        if end - begin > 1 and found[begin].kind != LIMIT and slips(
                s, kin, q, found, begin, end, size, in_step):
            spread_over_patch(s, ws, kin, q, begin, end, size)
        begin = end


@compiled
def slips(s: System, kin: Kinematics, q: np.ndarray, contacts: np.ndarray, begin: int, end: int,
          size: float, in_step: bool) -> bool:
    """Whether contacts begin to end - 1 are a flat patch of this ``size``, m, that slips; if
    ``in_step`` and steadily.
    """
    known = -1
    for e in range(begin, end):
        c = contacts[e]
        if dot(vec(c.normal), vec(contacts[begin].normal)) < FLAT:
            return False
        if known < 0 and 0 < c.friction < NO_SLIP and (c.persistent or not in_step):
            known = e
    if known < 0:
        return False
    c = contacts[known]
    a, b, turn = slip_at(s, kin, q, c, vec(c.friction_point))
    speed, change = abs(a) + abs(b) + size * abs(turn), 0.0
    if in_step:
        change = (abs(a - c.start_velocity[1]) + abs(b - c.start_velocity[2])
                  + size * abs(turn - c.spin))
    return speed > STILL and change < UNSTEADY * speed


@compiled
def slip_at(s: System, kin: Kinematics, q: np.ndarray, c: np.record,
            at: Vec3) -> tuple[float, float, float]:
    """Slip of the bodies of contact c at a point, m/s along its tangents, and rad/s about its
    normal.
    """
    a = b = turn = 0.0
    for side in range(2 if c.body_b >= 0 else 1):
        i, sign = (c.body_a, 1.0) if side == 0 else (c.body_b, -1.0)
        root = root_position(q, s.tree[s.body_root[i]].q_start)
        v = velocity_at(kin, i, sub(at, root))
        a += sign * dot(vec(c.tangents[0]), v)
        b += sign * dot(vec(c.tangents[1]), v)
        turn += sign * dot(vec(c.normal), vec(kin.spatial_velocities[i]))
    return a, b, turn


@compiled
def spread_over_patch(s: System, ws: Workspace, kin: Kinematics, q: np.ndarray, begin: int,
                      end: int, size: float) -> None:
    """Set friction points and coefficients of contacts begin to end - 1, a patch that slips."""
    found, total, middle = ws.contacts.found, 0.0, (0.0, 0.0, 0.0)
    for e in range(begin, end):
        middle = add(middle, divide(vec(found[e].point), end - begin))
    shift = 0.0, 0.0, 0.0
    for e in range(begin, end):
        c = found[e]
        total += c.impulse[0]
        shift = add_scaled(shift, c.impulse[0], sub(vec(c.point), vec(c.friction_point)))
    a, b, turn = slip_at(s, kin, q, found[begin], middle)
    if math.sqrt(a * a + b * b) > FAR * size * abs(turn):
        if total > 0.0:
            for e in range(begin, end):
                c = found[e]
                set_friction(c, add_scaled(vec(c.friction_point), 1 / total, shift), 1.0)
        return
    center, face = measure_face(s, ws.contacts, kin, begin, end, middle)
    a, b, turn = slip_at(s, kin, q, found[begin], center)
    turn_about(ws.contacts, begin, end, center, face, -b / turn, a / turn)


@compiled
def measure_face(s: System, contacts: Contacts, kin: Kinematics, begin: int, end: int,
                 middle: Vec3) -> tuple[Vec3, Face]:
    """Center, m, and face of a patch whose points have this ``middle``, m."""
    found, count, u, v = contacts.found, end - begin, contacts.u, contacts.v
    patch, first = found[begin].patch, found[begin]
    if count > 2 and patch < len(s.geoms) and s.geoms[patch].kind == CYLINDER:
        radius = s.geoms[patch].size[0]
        spread = 4 / (radius * radius)
        return (face_center(s.geoms[patch], patch, kin, first),
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
    """Center, m, and face of points on a line with these tangents, as those of contact c."""
    far = 0
    for k in range(count):
        if u[k] * u[k] + v[k] * v[k] > u[far] * u[far] + v[far] * v[far]:
            far = k
    x, y = u[far], v[far]
    square, least = x * x + y * y, 0.0
    for k in range(count):
        least = min(least, (u[k] * x + v[k] * y) / square)
    shift, half = (1 + least) / 2, (1 - least) / 2
    center = add_scaled(add_scaled(middle, shift * x, vec(c.tangents[0])), shift * y,
                        vec(c.tangents[1]))
    x, y = half * x, half * y
    u[0], v[0], u[1], v[1] = x, y, -x, -y
    spread = 3 / (half * half * square * half * half * square)
    return center, (SEGMENT, x, y, spread * x * x, spread * x * y, spread * y * y,
                    math.sqrt(1 / 3))


@compiled
def pressed_part(contacts: Contacts, count: int, face: Face, px: float,
                 py: float) -> tuple[float, float, float]:
    """Size of the part of the face, a copy of it, over which a pressure with the center (px, py) is
    affine and nowhere negative, over the face's, and the part's own center.
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
    """Moments of a face about the center (x, y)."""
    if face[0] == DISC:
        return disc_moments(face[1], x, y)
    if face[0] == SEGMENT:
        return segment_moments(face[1], face[2], x, y)
    return polygon_moments(contacts.u, contacts.v, count, face[1], x, y)


@compiled
def pull_and_moment(face: Face, moments: Moments, px: float,
                    py: float) -> tuple[float, float, float]:
    """Means of y/|y|, two numbers, and of |y| under the affine pressure with this center."""
    gx, gy = face[3] * px + face[4] * py, face[4] * px + face[5] * py
    return (moments[0] + gx * moments[2] + gy * moments[4],
            moments[1] + gx * moments[3] + gy * moments[5],
            max(0.0, moments[6] + gx * moments[7] + gy * moments[8]))


@compiled
def turn_about(contacts: Contacts, begin: int, end: int, center: Vec3, face: Face, x: float,
               y: float) -> None:
    """Set friction points and coefficients of a patch that turns about (x, y), from its center."""
    found, count = contacts.found, end - begin
    t, w = vec(found[begin].tangents[0]), vec(found[begin].tangents[1])
    total = px = py = size = 0.0
    for e in range(begin, end):
        arm, n = sub(vec(found[e].point), center), found[e].impulse[0]
        total, px, py = total + n, px + n * dot(t, arm), py + n * dot(w, arm)
        size = max(size, norm(arm))
    if total > 0.0:
        px, py = px / total, py / total
    share, cx, cy = pressed_part(contacts, count, face, px, py)
    own = face_moments(contacts, count, face, (x - cx) / share, (y - cy) / share)
    ox, oy = (px - cx) / share, (py - cy) / share
    jx, jy, mean = pull_and_moment(face, own, ox, oy)
    pull, spread = math.sqrt(jx * jx + jy * jy), face[6]
    for e in range(begin, end):
        arm = sub(vec(found[e].point), center)
        ax, ay = dot(t, arm) - px, dot(w, arm) - py
        if pull > PULL:
            # all pull alike; they are spread along the line through the center, which changes
            # nothing, except that they resist turning if the patch stops
            along, reach = (jx * ax + jy * ay) / pull, share * mean / pull
            reach += min(spread, reach / (2 * size)) * along
            strength, dx, dy = pull, jx / pull, jy / pull
        else:
            kx, ky, own_mean = pull_and_moment(face, own, ox + spread * ax, oy + spread * ay)
            strength = math.sqrt(kx * kx + ky * ky)
            if strength == 0.0:
                continue
            dx, dy = kx / strength, ky / strength
            reach = min(share * own_mean / strength, LONGEST * size)
            strength = share * own_mean / reach if reach > 0.0 else strength
        at = add_scaled(add_scaled(center, x + reach * dx, t), y + reach * dy, w)
        set_friction(found[e], at, strength)


@compiled
def set_friction(c: np.record, at: Vec3, strength: float) -> None:
    """Move the friction of contact c to the point ``at``, with its velocity at the step's start,
    and multiply its coefficient.
    """
    moved = sub(at, vec(c.friction_point))
    c.start_velocity[1] -= c.spin * dot(vec(c.tangents[1]), moved)
    c.start_velocity[2] += c.spin * dot(vec(c.tangents[0]), moved)
    put(c.friction_point, at)
    c.friction *= strength
