"""Gaps (k,): how far apart is everything that may touch.

In order: heights of each geom's ground points, m; distances of each limited joint from its lower
and its upper limit, rad; separations of the pairs of geoms, m, where they are far a lower bound,
and NEAR at internal edges; in a step, those of the points of pairs that touch (point_gaps.py).
"""
from __future__ import annotations

import math

import numpy as np

from ..collision.narrow_phase import separation
from ..collision.shapes import BOX, CAPSULE, HULL, PLANE, SPHERE, extent
from ..compiling.decorators import compiled
from ..dynamics.body import WORLD
from ..dynamics.kinematics import Kinematics, body_velocity, forward_kinematics, place_geoms
from ..maths.vectors import Vec3, column, divide, dot, neg, norm, sub, to_local, vec
from ..system import JOINT_OUTSIDE_LIMITS, OVERLAPPING, System
from ..workspace import Contacts, Workspace
from .internal_edges import FLUSH, is_at_internal_edge
from .placed_shape import placed_shape

MET = 5e-7
"""m or rad: geoms that are farther apart than this have no part in an impact, unless they approach
or were nearer in the last step: balls that almost touch hit one after the other."""

FAR = 0.02
"""m: of geoms that are farther from the ground, the gap of their bounding sphere will do."""

NEAR = 5e-3
"""m: the separation of geoms that are farther apart need not be exact: a lower bound will do."""

STILL_OVERLAPPING = 1e-3
"""m: geoms that overlapped at the start collide from when their penetration is less."""

BEYOND_LIMIT = 2e-3
"""rad: tolerance by which a joint may be outside its limits."""

DEEP_PENETRATION = 1e-3
"""m: deeper penetrations into the ground are corrected at whatever cost of energy."""

MOST_SPEEDUP = 3.0
"""Most by which impacts are taken to multiply a speed within a window of label_reachable()."""

LEVEL = 1e-6
"""Sine of the tilt below which the end of a cylinder lies flat: which point of its rim is lowest
says nothing, and would jump from step to step."""

SLOW = 0.02
"""m/s, and SLOW_TURN rad/s: contacts that close more slowly begin with the next step, without
restitution; their time of impact is not sought."""

SLOW_TURN = 0.1

NONE = -1
"""First point of a pair whose points have no gaps of their own, and index of such a point."""

EXCLUDED = 1e6
"""m or rad: the gap of what does not collide: an excluded pair, a kinematic body with another one
or with what never moves, the joints of a kinematic doll with their limits."""


@compiled
def update_kinematics_and_gaps(s: System, ws: Workspace, kin: Kinematics, q: np.ndarray,
                               v: np.ndarray, before: np.ndarray, h: float,
                               out: np.ndarray) -> None:
    """Make ``kin`` that of q and v, with its geoms, and write all gaps to ``out``."""
    forward_kinematics(s.tree, q, v, kin)
    update_gaps(s, ws, kin, q, before, h, out)


@compiled
def update_gaps(s: System, ws: Workspace, kin: Kinematics, q: np.ndarray, before: np.ndarray,
                h: float, out: np.ndarray) -> None:
    """Write all gaps at q to ``out`` (k,) and place the geoms in ``kin``, which is that of q and of
    the current velocities. ``before``: the gaps h s earlier (h infinite: unknown); may be ``out``.
    A pair that must still be farther apart than NEAR gets a lower bound without a narrow phase.

    EXCLUDED is written for pairs in ws.excluded, for pairs of a kinematic body with another one or
    with a static geom, and for ground points and joint limits of kinematic bodies. Not written are
    other gaps from the ground if there is none, and in a step those of pairs with tracked points:
    see update_point_gaps(). Reads the corrections in contacts.motion, writes its speeds.
    """
    place_geoms(s.tree, s.body_root, s.geoms, q, kin)
    n, narrow_phases = 0, 0
    for k in range(len(s.geoms)):
        if s.geoms[k].point_count and s.tree[s.geoms[k].body].kinematic:
            for j in range(s.geoms[k].point_count):
                out[n + j] = EXCLUDED
        elif s.geoms[k].point_count and s.ground_offset[0] > -math.inf:
            ground_gaps(s, s.geoms[k], kin.geom_positions[k], kin.geom_rotations[k],
                        vec(s.ground_normal), s.ground_offset[0], s.geoms[k].first_point, out)
        n += s.geoms[k].point_count
    for k in range(len(s.joint_limits)):
        limit = s.joint_limits[k]
        out[n], out[n + 1] = q[limit.q] - limit.lower, limit.upper - q[limit.q]
        if s.tree[s.dof_body[limit.dof]].kinematic:
            out[n] = out[n + 1] = EXCLUDED
        n += 2
    motion, tracks = ws.contacts.motion, ws.step.scalars[0].tracks_points != 0
    if len(s.pairs):
        for i in range(len(s.tree)):
            velocity, motion[i].angular_speed = body_velocity(kin, i)
            motion[i].speed = norm(velocity)
    for k in range(len(s.pairs)):
        if k < len(ws.excluded) and ws.excluded[k]:
            out[n + k] = EXCLUDED
            continue
        a, b = s.geoms[s.pairs[k].a], s.geoms[s.pairs[k].b]
        if s.tree[a.body].kinematic and (b.body == WORLD or s.tree[b.body].kinematic):
            out[n + k] = EXCLUDED
            continue
        if tracks and ws.contacts.first_point[k] != NONE:
            continue
        if b.kind == PLANE:
            if s.pairs[k].point == 0:
                normal, offset = plane_of(kin, s.pairs[k].b)
                i = s.pairs[k].a
                ground_gaps(s, a, kin.geom_positions[i], kin.geom_rotations[i], normal, offset,
                            n + k, out)
            continue
        least = before[n + k] - 2 * (geom_motion_bound(motion, a, h)
                                     + geom_motion_bound(motion, b, h))
        if least > NEAR:
            out[n + k] = least
        else:
            out[n + k] = without_internal_edges(s, ws, kin, k, pair_gap(s, k, kin))
            narrow_phases += 1
    ws.stats[0].ledger.gap_updates += 1
    ws.stats[0].ledger.narrow_phases += narrow_phases


@compiled
def clear_corrections(motion: np.ndarray) -> None:
    """Set the displacements by position correction (n,) to zero."""
    for i in range(len(motion)):
        motion[i].correction = motion[i].correction_angle = 0.0


@compiled
def label_reachable(s: System, ws: Workspace, kin: Kinematics, gaps: np.ndarray, h: float,
                    label: np.ndarray) -> None:
    """Group the dolls that may meet within h s, directly or through others: write the least index
    of its group to ``label`` (d,) of each doll. Speeds are multiplied by MOST_SPEEDUP. ``kin``,
    ``gaps``: current. Overwrites contacts.motion.
    """
    motion = ws.contacts.motion
    clear_corrections(motion)
    for i in range(len(s.tree)):
        velocity, motion[i].angular_speed = body_velocity(kin, i)
        motion[i].speed = norm(velocity)
    for d in range(len(label)):
        label[d] = d
    first = ws.gap_counts[0].fixed - len(s.pairs)
    for k in range(len(s.pairs)):
        a, b = s.geoms[s.pairs[k].a], s.geoms[s.pairs[k].b]
        if b.body == WORLD:
            continue
        one, other = label[s.body_doll[a.body]], label[s.body_doll[b.body]]
        reach = geom_motion_bound(motion, a, h) + geom_motion_bound(motion, b, h)
        if one != other and gaps[first + k] <= ws.step.scalars[0].touching + MOST_SPEEDUP * reach:
            low, high = min(one, other), max(one, other)
            for d in range(len(label)):
                if label[d] == high:
                    label[d] = low


@compiled
def motion_bound(motion: np.record, reach: float, h: float) -> float:
    """Distance, m, that no point within ``reach`` m of a body's center of mass exceeds in h s."""
    return (h * (motion.speed + motion.angular_speed * reach) + motion.correction
            + motion.correction_angle * reach)


@compiled
def geom_motion_bound(motion: np.ndarray, geom: np.record, h: float) -> float:
    """Distance, m, that no point of a geom exceeds in h s; ``motion`` (n,) of all bodies."""
    return 0.0 if geom.body == WORLD else motion_bound(motion[geom.body], geom.reach, h)


@compiled
def plane_of(kin: Kinematics, k: int) -> tuple[Vec3, float]:
    """Normal and offset, m, of a plane, geom k."""
    normal = column(kin.geom_rotations[k], 2)
    return normal, dot(normal, vec(kin.geom_positions[k]))


@compiled
def ground_gaps(s: System, geom: np.record, position: np.ndarray, r: np.ndarray, normal: Vec3,
                offset: float, first: int, out: np.ndarray) -> None:
    """Write the gaps, m, of a geom's ground points from a plane to ``out`` from ``first`` on, in
    the order of ground_point(). ``position``, ``r``: the geom's pose; ``normal``, ``offset``: of
    the ground or a plane. If the bounding sphere is farther than FAR, all get its gap. Of a
    cylinder whose end faces are tilted by a sine of 0.1 or more, rim points but the lowest get the
    height of their end's center, or FAR if that is more.
    """
    high = dot(vec(position), normal) - offset
    if high > geom.bounding_radius + FAR:
        for k in range(geom.point_count):
            out[first + k] = high - geom.bounding_radius
        return
    a, b, c = to_local(r, normal)
    size = geom.size
    if geom.kind == SPHERE:
        out[first] = high - size[0]
    elif geom.kind == CAPSULE:
        out[first], out[first + 1] = high - size[1] * c - size[0], high + size[1] * c - size[0]
    elif geom.kind == BOX:
        a, b, c = a * size[0], b * size[1], c * size[2]
        for k in range(8):
            out[first + k] = (high + (a if k & 1 else -a) + (b if k & 2 else -b)
                              + (c if k & 4 else -c))
    elif geom.kind == HULL:
        for k in range(geom.point_count):
            vertex = vec(s.hull_vertices[s.hulls[geom.hull].first_vertex + k].point)
            out[first + k] = high + dot(vertex, (a, b, c))
    else:
        low = size[0] * math.sqrt(max(0.0, 1 - c * c))
        a, b, c = a * size[0], b * size[0], c * size[1]
        flat = low < 0.1 * size[0]
        for end in range(2):
            rim, here = high + (c if end else -c), first + 5 * end
            out[here] = rim - low
            out[here + 1] = rim + a if flat else rim
            out[here + 2] = rim - a if flat else rim
            out[here + 3] = rim + b if flat else rim
            out[here + 4] = rim - b if flat else rim
            if not flat:
                for k in range(1, 5):
                    out[here + k] = max(rim, FAR)


@compiled
def ground_point(s: System, geom: np.record, k: int, position: np.ndarray, r: np.ndarray,
                 normal: Vec3) -> Vec3:
    """Point k of those of a geom that may touch a plane of this unit ``normal``, m, world.

    Sphere: the lowest. Capsule: the lowest of end k, 0 at -z. Box, hull: corner k. Cylinder, k = 5
    end + i, end 0 at -z: i = 0 is the lowest of that end's rim, 1 to 4 are those at +x, -x, +y, -y.
    ``position``, m, and r (3, 3): the geom's pose in the world.
    """
    size = geom.size
    x = y = z = 0.0
    if geom.kind <= CAPSULE:
        z = 0.0 if geom.kind == SPHERE else (size[1] if k else -size[1])
        return (position[0] + r[0, 2] * z - size[0] * normal[0],
                position[1] + r[1, 2] * z - size[0] * normal[1],
                position[2] + r[2, 2] * z - size[0] * normal[2])
    if geom.kind == BOX:
        x, y, z = (size[0] if k & 1 else -size[0], size[1] if k & 2 else -size[1],
                   size[2] if k & 4 else -size[2])
    elif geom.kind == HULL:
        x, y, z = vec(s.hull_vertices[s.hulls[geom.hull].first_vertex + k].point)
    else:
        z, k = (size[1] if k >= 5 else -size[1]), k % 5
        if k == 0:
            a, b, _ = to_local(r, normal)
            x, y = -a, -b
            far = math.sqrt(x * x + y * y)
            x, y = (x * size[0] / far, y * size[0] / far) if far > LEVEL else (size[0], 0.0)
        else:
            x = (0.0, size[0], -size[0], 0.0, 0.0)[k]
            y = (0.0, 0.0, 0.0, size[0], -size[0])[k]
    return (position[0] + r[0, 0] * x + r[0, 1] * y + r[0, 2] * z,
            position[1] + r[1, 0] * x + r[1, 1] * y + r[1, 2] * z,
            position[2] + r[2, 0] * x + r[2, 1] * y + r[2, 2] * z)


@compiled
def enable_separated_pairs(s: System, ws: Workspace, kin: Kinematics, q: np.ndarray,
                           v: np.ndarray) -> bool:
    """Clear the flags of ws.excluded whose reason is gone: OVERLAPPING of pairs that penetrate by
    less than STILL_OVERLAPPING, JOINT_OUTSIDE_LIMITS where the joints between the bodies are within
    their limits again, to 2 BEYOND_LIMIT. Returns whether a pair has lost its last flag, so that it
    may collide: its gap is not known yet. ``kin`` becomes that of q and v, but stays as it is if no
    pair is excluded.
    """
    excluded, some = ws.excluded, False
    for k in range(len(excluded)):
        some |= excluded[k] != 0
    if not some:
        return False
    some = False
    forward_kinematics(s.tree, q, v, kin)
    place_geoms(s.tree, s.body_root, s.geoms, q, kin)
    mark_joints_outside(s, q, ws.contacts.joint_outside)
    for k in range(len(excluded)):
        a, b, before = s.geoms[s.pairs[k].a], s.geoms[s.pairs[k].b], excluded[k]
        if excluded[k] & OVERLAPPING and pair_gap(s, k, kin) > -STILL_OVERLAPPING:
            excluded[k] &= ~OVERLAPPING
        if excluded[k] & JOINT_OUTSIDE_LIMITS and not limit_violated_between(
                s, ws.contacts, a.body, b.body):
            excluded[k] &= ~JOINT_OUTSIDE_LIMITS
        some |= before != 0 and excluded[k] == 0
    return some


@compiled
def mark_joints_outside(s: System, q: np.ndarray, outside: np.ndarray) -> None:
    """Write to ``outside``, one a body, whether its joint is outside its limits at q by more than
    2 BEYOND_LIMIT: 1 or 0.
    """
    for i in range(len(s.tree)):
        outside[i] = 0
    for k in range(len(s.joint_limits)):
        limit = s.joint_limits[k]
        if max(limit.lower - q[limit.q], q[limit.q] - limit.upper) > 2 * BEYOND_LIMIT:
            outside[s.dof_body[limit.dof]] = 1


@compiled
def limit_violated_between(s: System, contacts: Contacts, i: int, j: int) -> bool:
    """Whether a joint on the path between bodies i and j, or to both roots if their dolls differ,
    is marked in contacts.joint_outside.
    """
    while i != j:
        if i < j:
            i, j = j, i
        if contacts.joint_outside[i]:
            return True
        i = s.tree[i].parent
    return False


@compiled
def pair_gap(s: System, k: int, kin: Kinematics) -> float:
    """Separation, m, of pair k, whose geoms are placed in ``kin``; if farther apart than NEAR a
    lower bound, by their bounding spheres or their extents along the line of their centers.
    """
    i, j = s.pairs[k].a, s.pairs[k].b
    direction = sub(vec(kin.geom_positions[i]), vec(kin.geom_positions[j]))
    length = norm(direction)
    far = length - (s.geoms[i].bounding_radius + s.geoms[j].bounding_radius)
    if far > NEAR:
        return far
    a, b = placed_shape(s, kin, i), placed_shape(s, kin, j)
    if length > NEAR:
        direction = divide(direction, length)
        far = length - extent(a, neg(direction)) - extent(b, direction)
        if far > NEAR:
            return far
    return separation(a, b, NEAR)


@compiled
def without_internal_edges(s: System, ws: Workspace, kin: Kinematics, k: int, gap: float) -> float:
    """Gap of pair k, m: NEAR, as if the pair were apart, if ``gap`` is less than FLUSH and belongs
    to a ghost collision at an internal edge; else ``gap``. Overwrites contacts.edge_manifold.
    """
    if gap < FLUSH and is_at_internal_edge(s, kin, k, ws.contacts.edge_manifold):
        return NEAR
    return gap


@compiled
def first_joint_limit_gap(s: System, ws: Workspace) -> int:
    """Index of the first gap that is the distance of a joint from a limit."""
    return ws.gap_counts[0].fixed - len(s.pairs) - 2 * len(s.joint_limits)


@compiled
def is_joint_limit_gap(s: System, ws: Workspace, j: int) -> bool:
    """Whether gap j is the distance of a joint from a limit, rad (else m)."""
    first = first_joint_limit_gap(s, ws)
    return first <= j < first + 2 * len(s.joint_limits)


@compiled
def one_gap(s: System, ws: Workspace, kin: Kinematics, q: np.ndarray, j: int) -> float:
    """Gap j at q: of a ground point or a pair, m, or of a joint limit, rad; not of a point of a
    pair, see point_gaps.py. Exclusions and internal edges are ignored. ``kin``: of q, with its
    geoms.
    """
    n, first = 0, first_joint_limit_gap(s, ws)
    for k in range(len(s.geoms)):
        if n <= j < n + s.geoms[k].point_count:
            normal = vec(s.ground_normal)
            return dot(normal, ground_point(s, s.geoms[k], j - n, kin.geom_positions[k],
                                            kin.geom_rotations[k], normal)) - s.ground_offset[0]
        n += s.geoms[k].point_count
    if is_joint_limit_gap(s, ws, j):
        limit = s.joint_limits[(j - first) // 2]
        return limit.upper - q[limit.q] if (j - first) % 2 else q[limit.q] - limit.lower
    k = j - (ws.gap_counts[0].fixed - len(s.pairs))
    pair = s.pairs[k]
    if s.geoms[pair.b].kind == PLANE:
        normal, offset = plane_of(kin, pair.b)
        return dot(normal, ground_point(s, s.geoms[pair.a], pair.point,
                                        kin.geom_positions[pair.a], kin.geom_rotations[pair.a],
                                        normal)) - offset
    return pair_gap(s, k, kin)
