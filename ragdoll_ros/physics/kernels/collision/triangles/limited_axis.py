"""The axis of contact of a shape and a triangle, among the normals that its edges allow.

Along any unit vector d a shape a and a triangle are separated by s(d), the least of d x over a less
the largest of d x over the triangle. The largest s over all d is their distance. Candidates are, as
in SAT, the normals of faces and the cross products of edges; of a segment, the core of a sphere or
capsule, the directions between corners, edges and ends as well, so that the largest is among them.
The rim of a cylinder against an edge is taken for less apart than it is.
"""
from __future__ import annotations

from typing import NamedTuple

from ...compiling.decorators import compiled
from ...maths.vectors import (Vec3, add_scaled, column, cross, divide, dot, neg, norm, sub,
                               to_local, to_world)
from ..hulls.polyhedron import (edge_vector, hull_edges, hull_faces, hull_plane,
                                is_supporting_edge)
from ..shapes import BOX, CAPSULE, CYLINDER, HULL, SPHERE, Shape, core_extent
from .triangle import (Corners, allowed_at_edge, corners_of, edge_vectors,
                       is_allowed_at_corner, outward_vectors, seen_from_below, supporting_corner)

FACE, FIRST_CORNER = -1, 3
"""Features of a triangle: its face; its edges 0 to 2; its corners from FIRST_CORNER on."""

PARALLEL_SINE = 1e-8
"""Sine between two edges below which their cross product says nothing."""

SHORTEST = 1e-12
"""m: a vector that is shorter has no direction."""

REACH, BARELY = 0.05, 1e-6
"""m: what is on a triangle's plane and beside the triangle, but not farther than REACH, touches it:
it may come onto it within a step, and has contact points from when it does. BARELY is the largest
gap there, and the largest depth."""

IS_DISTANCE = 1e-7
"""m: an allowed separation that differs by less from the distance is between the nearest points."""

SHALLOW = 1e-3
"""m: what is deeper below a triangle's plane, and half as deep in it from beside, is beside it."""


class LimitedAxis(NamedTuple):
    """``distance``, m: the largest separation of all. ``allowed``: of those that the edges allow,
    along ``axis`` and between a and the ``feature`` of the triangle; ``face``: along the
    ``normal``, which points to the side of a's center; ``edges``: of that side. All are of a's
    core, without the radius of a sphere or capsule.
    """

    distance: float
    allowed: float
    axis: Vec3
    feature: int
    face: float
    normal: Vec3
    edges: Vec3


@compiled
def core_separation(a: Shape, corners: Corners, c: Vec3, d: Vec3) -> float:
    """Separation s(d), m, of a's core and the triangle along the unit vector d. ``c``: a's center
    from the triangle's, m.
    """
    half = 0.0 if a.kind == SPHERE else core_extent(a, neg(d))
    return dot(c, d) - half - max(dot(corners[0], d), dot(corners[1], d), dot(corners[2], d))


@compiled
def core_radius(a: Shape) -> float:
    """Radius, m, around the core of a sphere or capsule; 0 of other shapes."""
    return a.size[0] if a.kind <= CAPSULE else 0.0


@compiled
def triangle_lower_bounds(a: Shape, t: Shape) -> tuple[float, float]:
    """Two lower bounds, m, of the distance of the core of a from a triangle t: the separation along
    the triangle's normal on a's side, and the largest along the outward normals of its edges in
    its plane.
    """
    corners, c, normal = corners_of(t), sub(a.position, t.position), column(t.rotation, 2)
    outward = outward_vectors(edge_vectors(corners), normal)
    beside = max(core_separation(a, corners, c, outward[0]),
                 core_separation(a, corners, c, outward[1]),
                 core_separation(a, corners, c, outward[2]))
    return core_separation(a, corners, c, neg(normal) if dot(normal, c) < 0 else normal), beside


@compiled
def edge_direction(a: Shape, c: Vec3, corner: Vec3, edge: Vec3, turn: int) -> Vec3:
    """Candidate axis number ``turn`` of an edge of the triangle and a's core, perpendicular to the
    edge, not normalized.

    Box, hull: edge x edge ``turn`` of a. Others: 0: edge x axis of a; 1, 2: from the edge to an end
    of the axis. ``edge``: unit vector from ``corner``; ``c``, ``corner``: a's center and the
    corner from the triangle's center, m.
    """
    if a.kind == HULL:
        return cross(edge, to_world(a.rotation, edge_vector(a.system, a.hull, turn)))
    if a.kind == BOX:
        return cross(edge, column(a.rotation, turn))
    u = column(a.rotation, 2)
    if turn == 0:
        return cross(edge, u)
    half = 0.0 if a.kind == SPHERE else a.size[1]
    arm = sub(add_scaled(c, half if turn == 1 else -half, u), corner)
    return add_scaled(arm, -dot(arm, edge), edge)


@compiled
def corner_direction(a: Shape, c: Vec3, corner: Vec3) -> Vec3:
    """From a corner to the nearest point of the axis of a sphere, capsule or cylinder."""
    u, half = column(a.rotation, 2), 0.0 if a.kind == SPHERE else a.size[1]
    arm = sub(c, corner)
    t = min(max(-dot(arm, u), -half), half)
    return add_scaled(arm, t, u)


@compiled
def is_allowed_from_a_side(d: Vec3, normal: Vec3, outward: Corners, edges: Vec3, k: int) -> bool:
    """Whether both edges at corner k allow the direction ``d``, seen from the side of the triangle
    to which ``normal`` points, where a's center is; or, if ``d`` points to the other side, seen
    from there. A long shape on a sharp corner may have its center on one side of the triangle's
    plane while the contact's direction points to the other.
    """
    return is_allowed_at_corner(d, normal, outward, edges, k) or (
        dot(d, normal) < 0 and is_allowed_at_corner(d, neg(normal), outward,
                                                    seen_from_below(edges), k))


@compiled
def limited_axis(a: Shape, t: Shape) -> LimitedAxis:
    """Find the largest separation of a's core from the triangle t along any axis, and the largest
    along those that the edges allow, with its axis. Returns a LimitedAxis.
    """
    corners, c = corners_of(t), sub(a.position, t.position)
    directions, normal, edges = edge_vectors(corners), column(t.rotation, 2), t.edges
    outward = outward_vectors(directions, normal)
    if dot(normal, c) < 0:
        normal, edges = neg(normal), seen_from_below(edges)
    face = core_separation(a, corners, c, normal)
    distance = allowed = face
    axis, feature = normal, FACE
    first_turn, end_turn = hull_edges(a.system, a.hull) if a.kind == HULL else (0, 3)
    for k in range(3):
        distance = max(distance, core_separation(a, corners, c, outward[k]))
        for turn in range(first_turn, end_turn):
            if a.kind == SPHERE and turn != 1:
                continue
            d = edge_direction(a, c, corners[k], directions[k], turn)
            length = norm(d)
            if length < PARALLEL_SINE:
                continue
            d = divide(d, length)
            d = neg(d) if dot(d, c) < 0 else d
            if a.kind == HULL and not is_supporting_edge(
                    a.system, turn, neg(to_local(a.rotation, d))):
                continue
            found = core_separation(a, corners, c, d)
            distance = max(distance, found)
            limited = allowed_at_edge(d, normal, outward[k], edges[k])
            found = core_separation(a, corners, c, limited)
            if found > allowed:
                allowed, axis, feature = found, limited, k
    first, end = hull_faces(a.system, a.hull) if a.kind == HULL else (0, 3)
    for k in range(first, end):
        if a.kind == HULL:
            d = neg(to_world(a.rotation, hull_plane(a.system, k)[0]))
        elif a.kind <= CAPSULE or (a.kind == CYLINDER and k < 2):
            d = corner_direction(a, c, corners[k])
        else:
            d = column(a.rotation, k)
        length = norm(d)
        if length < SHORTEST:
            continue
        d = divide(d, length)
        if a.kind != HULL and dot(d, c) < 0:
            d = neg(d)
        found, corner = core_separation(a, corners, c, d), supporting_corner(corners, d)
        distance = max(distance, found)
        if found > allowed and is_allowed_from_a_side(d, normal, outward, edges, corner):
            allowed, axis, feature = found, d, FIRST_CORNER + corner
    return LimitedAxis(distance, allowed, axis, feature, face, normal, edges)


@compiled
def is_beside(found: LimitedAxis, radius: float) -> bool:
    """Whether a shape is beside a triangle, not on it: deeper than SHALLOW along the allowed axis,
    but less than half as deep along the best axis of all. Another face explains that depth.
    ``radius``: that of the core, see core_radius().
    """
    depth = found.allowed - radius
    return depth < -SHALLOW and found.distance - radius > depth / 2


@compiled
def is_contact_axis(found: LimitedAxis) -> bool:
    """Whether the allowed axis is that of a contact: the separation along it is the largest of all,
    to IS_DISTANCE; or, where the core of the shape overlaps the triangle, the depth along it is
    less than twice the least. The factor is for notches: where two faces meet at an angle, what
    lies on both is past the end of each, by its depth times a slope.
    """
    return found.allowed > min(found.distance, 2 * found.distance) - IS_DISTANCE


@compiled
def triangle_separation(a: Shape, t: Shape, cutoff: float) -> float:
    """Gap, m, of a shape and a triangle along the best axis that the edges allow. Beside the
    triangle, where another axis separates more and this is no contact axis, it is raised to the
    distance less REACH, if that is more: within REACH it stays the height above this plane or the
    next, but not below -BARELY. Where is_beside(), it is the distance, not below -BARELY. Of a hull
    with a lower bound above ``cutoff``, m, it is that bound.
    """
    if a.kind == HULL:
        height, beside = triangle_lower_bounds(a, t)
        if max(height, beside - REACH) > cutoff:
            return max(height, beside - REACH)
    found, radius = limited_axis(a, t), core_radius(a)
    distance, gap = found.distance - radius, found.allowed - radius
    if is_beside(found, radius):
        return max(distance, -BARELY)
    if distance > gap and not is_contact_axis(found):
        share = min(max(distance / REACH, 0.0), 1.0)
        return max(gap, distance - REACH, BARELY * share * share + min(max(distance, -BARELY), 0.0))
    return gap
