"""Contacts at a pose: the points of contact patches, joints at limits, and where friction acts."""
from __future__ import annotations

import math

import numpy as np

from ..collision.convex_manifold import END_OF_IDS
from ..collision.narrow_phase import collide
from ..collision.shapes import CYLINDER, PLANE, TRIANGLE
from ..collision.triangles.triangle_manifold import ON_FACE
from ..compiling.decorators import compiled
from ..contact_kind import FRICTIONAL, LIMIT, ROLLING
from ..dynamics.body import MOVED, WORLD
from ..dynamics.kinematics import Kinematics
from ..maths.vectors import Vec3, add_scaled, column, cross, divide, dot, norm, put, sub, vec
from ..system import System
from ..workspace import Contacts, Workspace
from .gaps import FAR, MET, NONE, SLOW, ground_point, plane_of
from .patch import contract_friction_points
from .placed_shape import placed_shape
from .point_gaps import points_at_start, is_contact_of_step

IDS_PER_PAIR = 1 << END_OF_IDS.bit_length()
"""Range of ids that the points of one pair have."""

KINEMATIC_FRICTION = 0.7
"""Largest friction of what moves whatever acts on it: limbs that stick to it and to the ground at
once could not yield. A roller between the two locks from 1 on."""

SAME_DIRECTION = 1e-3
"""Triangles whose normals differ by less along x and y may count as of one plane."""


@compiled
def find_contacts(s: System, ws: Workspace, kin: Kinematics, q: np.ndarray, gaps: np.ndarray,
                  h: float) -> int:
    """Find the contacts at q, the middle of a step of h s (h = 0: at an instant), and write them to
    contacts.found. Returns their number; contacts for which there is no room are dropped. ``kin``:
    of q, with its geoms.

    Ground points, points on planes, joint limits and pairs of other shapes are in contact if their
    gap in ``gaps`` is at most scalars.touching. Such a pair contributes points of its manifold. In
    a step, if its points are tracked: those that is_contact_of_step() accepts. Else: those with a
    gap of at most SLOW h (at an instant: scalars.touching) or, if that is more, of what the pair
    has closed since ws.gaps.
    """
    m, n, contacts, touching = 0, 0, ws.contacts.found, ws.step.scalars[0].touching
    for k in range(len(s.geoms)):
        if s.ground_offset[0] > -math.inf:
            for j in range(s.geoms[k].point_count):
                if gaps[n + j] <= touching and m < len(contacts):
                    contacts[m].id, contacts[m].patch = n + j, k
                    write_ground_contact(s, kin, k, j, vec(s.ground_normal), s.ground_offset[0],
                                         s.geoms[k], contacts[m])
                    m += 1
        n += s.geoms[k].point_count
    for k in range(len(s.joint_limits)):
        for side in range(2):
            if gaps[n + side] <= touching and m < len(contacts):
                write_limit(s, q, k, side, n + side, contacts[m])
                m += 1
        n += 2
    for k in range(len(s.pairs)):
        if gaps[n + k] <= touching and s.geoms[s.pairs[k].b].kind == PLANE:
            if m < len(contacts):
                pair = s.pairs[k]
                normal, offset = plane_of(kin, pair.b)
                contacts[m].id, contacts[m].patch = n + k, len(s.geoms) + k - pair.point
                write_ground_contact(s, kin, pair.a, pair.point, normal, offset, pair, contacts[m])
                m += 1
        elif gaps[n + k] <= touching:
            near = max(SLOW * h if h > 0 else touching, ws.gaps[n + k] - gaps[n + k])
            m = add_pair_contacts(s, ws, kin, q, k, m, near, h)
    set_friction_points(s, ws.contacts, kin, m)
    return m


@compiled
def write_ground_contact(s: System, kin: Kinematics, k: int, point: int, normal: Vec3,
                         offset: float, law: np.record, c: np.record) -> None:
    """Write to ``c`` the contact of geom k's ``point``, see gaps.ground_point(), with the ground or
    a plane of this ``normal`` and ``offset``, m: kind, bodies, point, normal, gap, friction and
    restitution. The caller writes id and patch. ``law``: the geom or the pair from which friction
    and restitution are taken.
    """
    geom = s.geoms[k]
    c.kind = ROLLING if law.rolling_friction > 0 else FRICTIONAL
    c.body_a, c.body_b = geom.body, WORLD
    put(c.point, ground_point(s, geom, point, kin.geom_positions[k], kin.geom_rotations[k],
                              normal))
    put(c.normal, normal)
    c.gap = dot(vec(c.point), normal) - offset
    c.friction, c.rolling_friction = law.friction, law.rolling_friction
    c.restitution = law.restitution


@compiled
def write_limit(s: System, q: np.ndarray, k: int, side: int, id_: int, c: np.record) -> None:
    """Write to ``c`` joint limit k, lower (``side`` 0) or upper (1); ``id_``: index of its gap."""
    limit = s.joint_limits[k]
    c.kind, c.id, c.patch = LIMIT, id_, -1
    c.body_a, c.body_b, c.dof = s.dof_body[limit.dof], WORLD, limit.dof
    c.limit_sign = 1.0 if side == 0 else -1.0
    c.gap = q[limit.q] - limit.lower if side == 0 else limit.upper - q[limit.q]
    c.friction = c.rolling_friction = c.restitution = 0.0


@compiled
def add_pair_contacts(s: System, ws: Workspace, kin: Kinematics, q: np.ndarray, k: int, m: int,
                      margin: float, h: float) -> int:
    """Append the contact points of pair k to the m contacts in contacts.found. Returns the new
    number. In a step (h > 0) of a pair with tracked points: those that is_contact_of_step()
    accepts. Else: points with a gap of at most ``margin``, m. Friction of MOVED bodies is at most
    KINEMATIC_FRICTION.
    """
    pair, contacts, manifold, begin = s.pairs[k], ws.contacts, ws.contacts.manifold, 0
    a, b, first_id = s.geoms[pair.a], s.geoms[pair.b], ws.gap_counts[0].fixed + IDS_PER_PAIR * k
    tracked = ws.step.scalars[0].tracks_points != 0 and contacts.first_point[k] != NONE
    if tracked and h == 0.0:
        manifold, (begin, end) = contacts.points, points_at_start(ws, k)
    else:
        end = collide(placed_shape(s, kin, pair.a), placed_shape(s, kin, pair.b),
                      FAR if tracked else margin, manifold)
    for j in range(begin, end):
        if m >= len(contacts.found):
            break
        c, at = contacts.found[m], manifold[j]
        if at.gap > margin if h == 0.0 else tracked and not (
                is_contact_of_step(s, ws, kin, q, k, at, h)):
            continue
        c.kind = ROLLING if pair.rolling_friction > 0 else FRICTIONAL
        c.body_a, c.body_b, c.id = a.body, b.body, first_id + at.feature_id
        if b.kind == TRIANGLE and at.feature_id < ON_FACE:
            c.id = id_on_plane(s, pair.a, vec(at.normal), at.feature_id)
        c.patch = len(s.geoms) + k
        put(c.point, vec(at.point))
        put(c.normal, vec(at.normal))
        c.gap, c.friction, c.rolling_friction = at.gap, pair.friction, pair.rolling_friction
        c.restitution = pair.restitution
        if s.tree[a.body].kinematic == MOVED or (
                b.body != WORLD and s.tree[b.body].kinematic == MOVED):
            c.friction = min(c.friction, KINEMATIC_FRICTION)
        m += 1
    return m


@compiled
def id_on_plane(s: System, a: int, n: Vec3, vertex: int) -> int:
    """Return the id of the contact of a vertex of geom ``a`` with a triangle's face of unit normal
    n. It depends on n's x and y, rounded to SAME_DIRECTION, and the sign of its z, but not on the
    triangle, so that a contact that slides from one triangle to the next persists. No other ids are
    negative.
    """
    x, y = round(n[0] / SAME_DIRECTION), round(n[1] / SAME_DIRECTION)
    size = round(2 / SAME_DIRECTION) + 1
    plane = (x * size + y) * 2 + (1 if n[2] > 0 else 0)
    return -1 - ((plane + size * size) * len(s.geoms) + a) * ON_FACE - vertex


@compiled
def set_friction_points(s: System, contacts: Contacts, kin: Kinematics, m: int) -> None:
    """Write the tangents, friction points and patch shares (1) of the first m contacts in
    contacts.found, except joint limits. Contacts of one patch must be adjacent. Their friction
    points are nearer to the center of the patch than their points, where the normal forces act.

    Under a uniform pressure p, friction against turning about the center has the moment mu times
    the integral of p times the distance: its lever arm is the mean distance over the patch, not
    over its corners.
    """
    found, begin = contacts.found, 0
    while begin < m:
        end = patch_end(found, begin, m)
        if found[begin].kind == LIMIT:
            begin = end
            continue
        for e in range(begin, end):
            c = found[e]
            set_tangents(c)
            put(c.friction_point, vec(c.point))
            c.patch_share = 1.0
        disc = cylinder_of_patch(s, found[begin].patch) if end - begin > 2 else -1
        if disc >= 0:
            contract_to_disc(s.geoms[disc], disc, kin, found, begin, end)
        elif end - begin > 1:
            contract_friction_points(contacts, begin, end)
        begin = end


@compiled
def is_on_plane(s: System, patch: int) -> bool:
    """Whether a contact patch is with the ground or a plane body, where each point has its own gap.

    ``patch``: index of the geom on the ground, else number of geoms + index of the pair; not that
    of a joint limit, -1.
    """
    return patch < len(s.geoms) or s.geoms[s.pairs[patch - len(s.geoms)].b].kind == PLANE


@compiled
def cylinder_of_patch(s: System, patch: int) -> int:
    """Index of the cylinder that has this contact patch with the ground or a plane, else -1."""
    if not is_on_plane(s, patch):
        return -1
    k = patch if patch < len(s.geoms) else s.pairs[patch - len(s.geoms)].a
    return k if s.geoms[k].kind == CYLINDER else -1


@compiled
def patch_end(contacts: np.ndarray, begin: int, m: int) -> int:
    """Index after the last contact of the patch that starts at ``begin``, among m contacts. A joint
    limit, which has patch -1, counts as a patch of its own.
    """
    patch, end = contacts[begin].patch, begin + 1
    while end < m and contacts[end].patch == patch and patch >= 0:
        end += 1
    return end


@compiled
def face_center(geom: np.record, k: int, kin: Kinematics, c: np.record) -> Vec3:
    """Center, m, world, of the end face of cylinder k that faces against the normal of c, the
    cylinder's contact with a plane.
    """
    axis = column(kin.geom_rotations[k], 2)
    low = -geom.size[1] if dot(axis, vec(c.normal)) > 0 else geom.size[1]
    return add_scaled(vec(kin.geom_positions[k]), low, axis)


@compiled
def contract_to_disc(geom: np.record, k: int, kin: Kinematics, contacts: np.ndarray, begin: int,
                     end: int) -> None:
    """Write the friction points of contacts begin to end - 1, which are on the rim of an end face
    of cylinder k on a plane: at two thirds of the radius, the mean distance of a disc's points from
    its center.
    """
    center = face_center(geom, k, kin, contacts[begin])
    for e in range(begin, end):
        c = contacts[e]
        put(c.friction_point, add_scaled(center, 2 / 3, sub(vec(c.point), center)))


@compiled
def set_tangents(c: np.record) -> None:
    """Write two unit vectors that are perpendicular to a contact's normal and to each other, right-
    handed with the normal first, to c.tangents.
    """
    n = vec(c.normal)
    if abs(n[2]) > 0.7:
        t = 1 - n[0] * n[0], -n[0] * n[1], -n[0] * n[2]
    else:
        t = -n[2] * n[0], -n[2] * n[1], 1 - n[2] * n[2]
    t = divide(t, norm(t))
    put(c.tangents[0], t)
    put(c.tangents[1], cross(n, t))


@compiled
def find_id(contacts: np.ndarray, count: int, id_: int, near: int) -> int:
    """Index of the contact with this id among ``count``, searched from ``near`` on, as most keep
    their order; ``count`` if there is none.
    """
    for n in range(count):
        j = near + n
        if j >= count:
            j -= count
        if contacts[j].id == id_:
            return j
    return count


@compiled
def had_met(s: System, contacts: np.ndarray, count: int, id_: int) -> bool:
    """Whether the contact with this id took part in the last step, whose contacts are the first
    ``count`` of ``contacts``: it is among them, and either its gap was at most MET, or a contact
    between the same two dolls had a normal impulse; of a contact with the WORLD, one of the same
    doll with the ground, a static geom or a joint limit. An impulse of its own is not required: of
    redundant contacts rounding decides which have one.
    """
    j = find_id(contacts, count, id_, 0)
    if j == count or contacts[j].gap <= MET:
        return j < count
    for k in range(count):
        if contacts[k].impulse[0] > 0 and (
                doll_of(s, contacts[k].body_a) == doll_of(s, contacts[j].body_a)) and (
                doll_of(s, contacts[k].body_b) == doll_of(s, contacts[j].body_b)):
            return True
    return False


@compiled
def doll_of(s: System, body: int) -> int:
    """Index of a body's doll, -1 for the WORLD."""
    return s.body_doll[body] if body >= 0 else -1
