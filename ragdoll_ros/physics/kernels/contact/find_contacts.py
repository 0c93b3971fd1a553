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
    """Write to contacts.found the contacts at q, the middle of a step of h s, which touch by
    ``gaps``; h = 0: those at an instant. Of a pair they are the points whose own gap touches, or
    where they have none, those nearer than what closes slowly in h s, or than the pair has closed
    since ws.gaps, if that is more. Returns their number. ``kin``: of q, with its geoms.
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
    a plane of this ``normal`` and ``offset``, but for id, patch and what set_friction_points()
    writes; ``law``: the geom or the pair, whose friction and restitution count.
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
    """Append the points of pair k to m contacts in contacts.found, those without gaps of their own
    if nearer than ``margin`` m: see find_contacts(). Returns their number then.
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
    """Id of the contact of a vertex of geom ``a`` with a face of normal n, which is rounded: the
    same on all faces of this normal, so that what slides from one triangle to the next persists. It
    is below 0, as no other is.
    """
    x, y = round(n[0] / SAME_DIRECTION), round(n[1] / SAME_DIRECTION)
    size = round(2 / SAME_DIRECTION) + 1
    plane = (x * size + y) * 2 + (1 if n[2] > 0 else 0)
    return -1 - ((plane + size * size) * len(s.geoms) + a) * ON_FACE - vertex


@compiled
def set_friction_points(s: System, contacts: Contacts, kin: Kinematics, m: int) -> None:
    """Write tangents, friction points and patch shares of m contacts, limits excepted, to
    contacts.found. Those of a patch must be adjacent; friction acts nearer to its center than the
    normal forces.

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
    """Index of the first of m contacts after ``begin`` that is not of the same patch."""
    patch, end = contacts[begin].patch, begin + 1
    while end < m and contacts[end].patch == patch and patch >= 0:
        end += 1
    return end


@compiled
def face_center(geom: np.record, k: int, kin: Kinematics, c: np.record) -> Vec3:
    """Center, m, of the face of cylinder k that has contact c with a plane."""
    axis = column(kin.geom_rotations[k], 2)
    low = -geom.size[1] if dot(axis, vec(c.normal)) > 0 else geom.size[1]
    return add_scaled(vec(kin.geom_positions[k]), low, axis)


@compiled
def contract_to_disc(geom: np.record, k: int, kin: Kinematics, contacts: np.ndarray, begin: int,
                     end: int) -> None:
    """Write friction points of contacts begin to end - 1, the face of cylinder k on a plane: at
    two thirds of the radius, the mean distance of a disc's points from its center.
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
    """Whether the contact with this id was one of the ``count`` of the last step, and had a gap of
    at most MET or any contact of the same two dolls had a normal impulse; of one doll, any contact
    with the ground or at its limits. Its own impulse is not asked for: of redundant contacts
    rounding decides which have one.
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
