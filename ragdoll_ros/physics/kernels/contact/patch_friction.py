"""Friction of patches that slip, as that of all their points together; see slip_integrals.py.

A patch that slides and turns has an instantaneous center. Where the friction of its points adds up
to the share j of mu times the normal force, and has the mean lever arm m about the center, it is
that of one point in whose direction it pulls, m / j from the center, with a coefficient of j mu:
only there is the slip in line with it. Contacts get such points, and such shares j, that with their
normal impulses the friction of the patch is exact. Those are known only after the step, which is
therefore solved again where they differ. Where the slip changes fast, the friction points of
find_contacts.set_friction_points() are moved so that their center is that of pressure; where it
sticks, they stay.
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

FAR_CENTER = 50.0
"""Distance of the center, over the size of the patch, from which on a patch merely slides."""

FLAT = 0.999
"""Least cosine between the normals of a patch."""

WEAK = 0.3
"""Share of the friction that is left in sum, below which its contacts have several directions, as
in a patch that turns about its middle."""

POINTLIKE = 0.25
"""Share of a face below which its pressed part is as good as a point, about which it may pivot: its
contacts could not represent more."""

MOVED = 1e-3
"""Change of a friction point, over the size of the patch, or of its share, that is worth a new
solve."""

LONGEST = 4.0
"""Longest lever arm of a contact's friction, over the size of the patch."""


@compiled
def set_slip_friction(s: System, ws: Workspace, kin: Kinematics, q: np.ndarray, m: int,
                      h: float) -> bool:
    """Set friction points and shares of the flat patches with limited friction among m found
    contacts, by set_patch_friction(), from the latest impulses: before the first solve those of
    warm_start(). Patches of one contact are left out.

    ``kin``: of q, whose velocities give the slip. ``h``: length of the step, s; 0: an impact.
    start_velocity becomes that at the new points. Returns whether any point or share has changed by
    more than MOVED: then solve again.
    """
    found, begin, changed = ws.contacts.found, 0, False
    while begin < m:
        end = patch_end(found, begin, m)
        if end - begin > 1 and found[begin].kind != LIMIT:
            reference = reference_contact(found, begin, end, h > 0)
            if reference >= 0:
                changed |= set_patch_friction(s, ws, kin, q, begin, end, reference, h)
        begin = end
    return changed


@compiled
def reference_contact(contacts: np.ndarray, begin: int, end: int, in_step: bool) -> int:
    """Index of a contact of a flat patch with limited friction: a coefficient above 0 and below
    NO_SLIP. With ``in_step`` preferably a persistent one. -1 if there is none, or if the patch is
    not flat.
    """
    reference = -1
    for e in range(begin, end):
        c = contacts[e]
        if dot(vec(c.normal), vec(contacts[begin].normal)) < FLAT:
            return -1
        if 0 < c.friction < NO_SLIP and (reference < 0 or (
                in_step and c.persistent and not contacts[reference].persistent)):
            reference = e
    return reference


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
def set_patch_friction(s: System, ws: Workspace, kin: Kinematics, q: np.ndarray, begin: int,
                      end: int, reference: int, h: float) -> bool:
    """Set the friction points and patch_share, a factor on the friction coefficient, of contacts
    begin to end - 1, a flat patch, from their normal impulses and the patch's slip at q.

    ``reference``: index of the contact whose tangents are the axes of the slip. ``h``: length of
    the step, s; 0: an impact. A patch that slips slower than STILL sticks: it is left unchanged. A
    patch that turns, in an impact or steadily, see is_steady(), gets points and shares by its
    instantaneous center of rotation, see turn_about(). Any other, or one whose pressed part is
    POINTLIKE, keeps its shares; if it has normal impulses, its points are shifted so that their
    mean, weighted by these, is the center of pressure. Returns whether one changed beyond MOVED.
    """
    found, total, count = ws.contacts.found, 0.0, end - begin
    middle = pressed = mean = (0.0, 0.0, 0.0)
    for e in range(begin, end):
        c = found[e]
        total += c.impulse[0]
        middle = add_scaled(middle, 1 / count, vec(c.point))
        pressed = add_scaled(pressed, c.impulse[0], vec(c.point))
        mean = add_scaled(mean, c.impulse[0], vec(c.friction_point))
    if total > 0.0:
        pressed, mean = divide(pressed, total), divide(mean, total)
    size = norm(sub(vec(found[begin].point), vec(found[end - 1].point))) / 2
    a, b, turn = slip_at(s, kin, q, found[reference], pressed if total > 0.0 else middle)
    if not abs(a) + abs(b) + size * abs(turn) > STILL:
        return False
    if math.sqrt(a * a + b * b) < FAR_CENTER * size * abs(turn):
        center, face = measure_face(s, ws.contacts, kin, begin, end, middle)
        if not total > 0.0:
            pressed = center
        slip, arm = slip_at(s, kin, q, found[reference], pressed), sub(pressed, center)
        x, y = dot(vec(found[begin].tangents[0]), arm), dot(vec(found[begin].tangents[1]), arm)
        part = pressed_part(ws.contacts, count, face, x, y)
        slow = h * found[reference].friction * norm(vec(s.gravity))
        if part[0] > POINTLIKE and (h == 0.0 or is_steady(
                found[reference], pressed, slip, part[0] * size, slow)):
            return turn_about(ws.contacts, begin, end, center, face, part, (x, y),
                              (x - slip[1] / slip[2], y + slip[0] / slip[2]))
    changed = False
    if total > 0.0:
        for e in range(begin, end):
            c = found[e]
            changed |= set_friction(c, add(vec(c.friction_point), sub(pressed, mean)),
                                    c.patch_share, size)
    return changed


@compiled
def is_steady(c: np.record, at: Vec3, slip: tuple[float, float, float], size: float,
              slow: float) -> bool:
    """Whether a persistent contact c slips faster than ``slow``, m/s, the speed that friction can
    stop in a step, and its slip has changed by less than the share UNSTEADY since the step began.

    ``slip``: along the tangents, m/s, and about the normal, rad/s, at the point ``at``, m, world.
    ``size``: half extent of its patch, m.
    """
    speed, arm = abs(slip[0]) + abs(slip[1]) + size * abs(slip[2]), sub(at, vec(c.friction_point))
    change = (abs(slip[0] - c.start_velocity[1] + c.spin * dot(vec(c.tangents[1]), arm))
              + abs(slip[1] - c.start_velocity[2] - c.spin * dot(vec(c.tangents[0]), arm))
              + size * abs(slip[2] - c.spin))
    return c.persistent != 0 and speed > slow and change < UNSTEADY * speed


@compiled
def turn_about(contacts: Contacts, begin: int, end: int, center: Vec3, face: Face,
               part: tuple[float, float, float], pressed: tuple[float, float],
               about: tuple[float, float]) -> bool:
    """Set friction points and shares of contacts begin to end - 1, a patch that turns about a
    point. ``about``, this point, and ``pressed``, the center of pressure: from ``center`` along the
    tangents, m. ``part``: the pressed part of its ``face``, see pressed_part().

    If the resultant of the patch's friction, over mu times its normal force, is above WEAK, all
    points are put on one line through ``about``, spread along it, with one share. Else each gets a
    direction and share of its own, or stays if its own resultant is 0. Returns whether a point or
    share has changed by more than MOVED.
    """
    found, size, changed = contacts.found, 0.0, False
    t, w = vec(found[begin].tangents[0]), vec(found[begin].tangents[1])
    for e in range(begin, end):
        size = max(size, norm(sub(vec(found[e].point), center)))
    share, cx, cy = part
    (px, py), (x, y) = pressed, about
    own = face_moments(contacts, end - begin, face, (x - cx) / share, (y - cy) / share)
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
            reach += min(share * spread, reach / (2 * size)) * lengthwise
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
        changed |= set_friction(found[e], at, strength, size)
    return changed


@compiled
def set_friction(c: np.record, at: Vec3, share: float, size: float) -> bool:
    """Set the friction point of contact c to ``at``, m, and its patch share to ``share``; shift the
    tangential start_velocity to the new point. Returns whether the point, over the patch's
    ``size``, m, or the share has changed by more than MOVED.
    """
    moved, before = sub(at, vec(c.friction_point)), c.patch_share
    c.start_velocity[1] -= c.spin * dot(vec(c.tangents[1]), moved)
    c.start_velocity[2] += c.spin * dot(vec(c.tangents[0]), moved)
    put(c.friction_point, at)
    c.patch_share = share
    return norm(moved) > MOVED * size or abs(share - before) > MOVED
