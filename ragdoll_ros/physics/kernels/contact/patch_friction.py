"""Friction of patches that slip, as that of all their points together; see slip_integrals.py.

A patch that slides and turns has an instantaneous center. Where the friction of its points adds up
to the share j of mu times the normal force, and has the mean lever arm m about the center, it is
that of one point in whose direction it pulls, m / j from the center, with a coefficient of j mu:
only there is the slip in line with it. Contacts get such points, and coefficients, that with their
normal impulses of the last step the friction of the patch is exact. Elsewhere friction points are
those of find_contacts.set_friction_points(): where a patch sticks, or its slip changes fast.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..contact_kind import LIMIT
from ..dynamics.kinematics import Kinematics, root_position, velocity_at
from ..maths.vectors import Vec3, add, add_scaled, divide, dot, norm, put, sub, vec
from ..system import NO_SLIP, System
from ..workspace import Contacts, Workspace
from .find_contacts import patch_end
from .patch_face import Face, face_moments, measure_face, pressed_part, resultant_and_moment

STILL = 1e-4
"""m/s: slower slip may be that of what sticks."""

UNSTEADY = 0.25
"""Change of the slip in half a step, as a share of it, above which it says nothing of the next."""

FAR = 50.0
"""Distance of the center, over the size of the patch, from which on a patch merely slides."""

FLAT = 0.999
"""Least cosine between the normals of a patch."""

WEAK = 0.3
"""Share of the friction that is left in sum, below which its contacts have several directions, as
in a patch that turns about its middle."""

LONGEST = 4.0
"""Longest lever arm of a contact's friction, over the size of the patch."""


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
    offset = 0.0, 0.0, 0.0
    for e in range(begin, end):
        c = found[e]
        total += c.impulse[0]
        offset = add_scaled(offset, c.impulse[0], sub(vec(c.point), vec(c.friction_point)))
    a, b, turn = slip_at(s, kin, q, found[begin], middle)
    if math.sqrt(a * a + b * b) > FAR * size * abs(turn):
        if total > 0.0:
            for e in range(begin, end):
                c = found[e]
                set_friction(c, add_scaled(vec(c.friction_point), 1 / total, offset), 1.0)
        return
    center, face = measure_face(s, ws.contacts, kin, begin, end, middle)
    a, b, turn = slip_at(s, kin, q, found[begin], center)
    turn_about(ws.contacts, begin, end, center, face, -b / turn, a / turn)


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
    jx, jy, mean = resultant_and_moment(face, own, ox, oy)
    resultant, spread = math.sqrt(jx * jx + jy * jy), face[6]
    for e in range(begin, end):
        arm = sub(vec(found[e].point), center)
        ax, ay = dot(t, arm) - px, dot(w, arm) - py
        if resultant > WEAK:
            # all have one direction; on the line through the center they can be spread, which
            # changes nothing, except that they resist turning if the patch stops
            lengthwise, reach = (jx * ax + jy * ay) / resultant, share * mean / resultant
            reach += min(spread, reach / (2 * size)) * lengthwise
            strength, dx, dy = resultant, jx / resultant, jy / resultant
        else:
            kx, ky, own_mean = resultant_and_moment(face, own, ox + spread * ax, oy + spread * ay)
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
