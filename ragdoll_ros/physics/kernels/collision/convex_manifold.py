"""Contact manifolds of boxes, cylinders and hulls: one's face clipped by the sides of the other's.

The reference face is the one more nearly perpendicular to the contact normal n. Polygons are seen
and gaps measured along n, not along the face's normal, so that the deepest point is as deep as the
shapes. Where no face is perpendicular to n, two edges, a vertex or a rim touch.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..maths.vectors import Vec3, add, add_scaled, dot, neg, put, scale, sub, vec
from .clipping import MAX_CLIPPED, clip_polygon
from .features import (FEATURE_SINE, MAX_CORNERS, corner_id, face_cosine, face_normal,
                       supporting_edge, supporting_face)
from .manifold import CLIP_VERTEX, merge_points, reduce_points, sort_points
from .separating_axis import (FACE_BIAS, FACE_BIAS_RATIO, Axis, face_or_edge_axis, needs_search,
                              refine_axis)
from .shapes import CYLINDER, HULL, Shape, bounding_radius, moved_to, support_point

FACE_COSINE = math.sqrt(1 - FEATURE_SINE * FEATURE_SINE)

PARALLEL_EDGES_SINE = 1e-3
"""Sine between two edges up to which they touch at two points, not at one."""

MERGE_RATIO = 1e-3
"""Points closer than this part of the smaller bounding radius are merged."""

FACE_TIE = 1e-10
"""Faces whose cosines differ by less are equal: the reference is b, which may be static, so that
the points on it are corners of a as when a is tilted; it is a if b alone is a cylinder."""

DEPTH_TOLERANCE = 1e-10
"""m: tolerance of the deepest point's gap against the shapes' separation where the axis is no face
normal; where it is one, the bias of faces."""

CORNER_IDS = 12 * 6 * 2 * MAX_CORNERS * 2 * MAX_CORNERS
"""First of the feature ids of corners on the reference face, whichever the incident face is: below
it points are known by both faces and the sides that meet there."""

MAX_FACES, MAX_VERTICES = 4096, 65536
"""Of a hull: beyond them ids repeat, and a point may count as another that lasts."""

FIRST_HULL_ID = 2 * CORNER_IDS
HULL_CORNER_IDS = FIRST_HULL_ID + 2 * MAX_FACES * MAX_FACES * (2 * MAX_CORNERS) ** 2
END_OF_IDS = HULL_CORNER_IDS + 2 * MAX_FACES * MAX_VERTICES
"""Ids of points of hulls: of two faces and the sides that meet, and of corners of the incident one
on the reference face; none is larger."""

CLOSEST_POINTS_ID = 2 * MAX_CORNERS * 2 * MAX_CORNERS - 1
"""Feature id of the contact at the closest points, which no two sides of faces have."""


@compiled
def _contact_axis(a: Shape, b: Shape, c: Vec3, margin: float) -> Axis:
    """Find the best face normal, unless another axis is clearly better. Returns an Axis; any with a
    separation above ``margin``, m, will do. ``c``: from b's center to a's.
    """
    sat = face_or_edge_axis(a, b, c, 1.0, margin)
    if sat[0] <= margin and needs_search(a, b):
        refined = refine_axis(a, b, c, sat)
        if refined[0] > sat[0] + FACE_BIAS + FACE_BIAS_RATIO * abs(sat[0]):
            return refined
    return sat


@compiled
def convex_manifold(a: Shape, b: Shape, margin: float, manifold: np.ndarray) -> int:
    """Write the manifold of boxes, cylinders or hulls; arguments and return value as collide()."""
    origin = b.position
    a, b = moved_to(a, sub(a.position, origin)), moved_to(b, (0.0, 0.0, 0.0))
    s, n = _contact_axis(a, b, a.position, margin)
    if s > margin:
        return 0
    scratch = np.empty(2 * MAX_CLIPPED + 2 * MAX_CORNERS, CLIP_VERTEX)
    points = scratch[MAX_CLIPPED:2 * MAX_CLIPPED]
    cosine_a, cosine_b = face_cosine(a, neg(n)), face_cosine(b, n)
    cosine = max(cosine_a, cosine_b)
    along_face = cosine > 1 - FACE_TIE
    incident, reference, sign = b, a, -1.0
    is_on_a = a.kind != CYLINDER and b.kind == CYLINDER
    if cosine_b > cosine_a + (FACE_TIE if is_on_a else -FACE_TIE):
        incident, reference, sign = a, b, 1.0
    if cosine >= FACE_COSINE:
        count = _clip_faces(incident, reference, n, sign, scratch)
    else:
        middle, u, other, v = supporting_edges(a, b, n)
        count = clip_edges(middle, u, other, v, n, points)
    least = math.inf
    for i in range(count):
        least = min(least, points[i].gap)
    if least > s + (FACE_BIAS + FACE_BIAS_RATIO * abs(s) if along_face else DEPTH_TOLERANCE):
        if along_face:
            # a vertex or rim on the reference face
            vertex = add(incident.position, support_point(incident, scale(-sign, n)))
            middle = add_scaled(vertex, -(sign * s / 2), n)
        else:
            middle, u, other, v = supporting_edges(a, b, n)
            middle = closest_on_edges(middle, u, other, v, n, s)
        put(points[count].point, middle)
        points[count].gap, points[count].feature_id = s, CLOSEST_POINTS_ID
        count += 1
    distance = MERGE_RATIO * min(bounding_radius(a), bounding_radius(b))
    count = reduce_points(points, merge_points(points, count, margin, distance))
    sort_points(points, count)
    for i in range(count):
        contact, point = manifold[i], points[i]
        put(contact.point, add(origin, vec(point.point)))
        put(contact.normal, n)
        contact.gap, contact.feature_id = point.gap, point.feature_id
    return count


@compiled
def _clip_faces(incident: Shape, reference: Shape, n: Vec3, sign: float,
                scratch: np.ndarray) -> int:
    """Clip the incident face by the reference face, seen along n. Writes the points, midway between
    the faces, with gaps along n, which may be positive, and feature ids, to ``scratch`` from
    MAX_CLIPPED on; returns their number. The rest of ``scratch`` is overwritten. ``sign``: 1 if n
    points out of the reference, else -1.
    """
    polygon, points = scratch[:MAX_CLIPPED], scratch[MAX_CLIPPED:2 * MAX_CLIPPED]
    corners, names = (scratch[2 * MAX_CLIPPED:2 * MAX_CLIPPED + MAX_CORNERS],
                      scratch[2 * MAX_CLIPPED + MAX_CORNERS:])
    outward, inward = scale(sign, n), scale(-sign, n)
    number, incident_face = supporting_face(incident, inward, (0.0, 0.0, 0.0), polygon)
    deepest = sub(add(incident.position, support_point(incident, inward)), reference.position)
    count, face = supporting_face(reference, outward, deepest, corners)
    if count % 2:
        corners[count] = corners[count - 1]
        count += 1
    offset = sub(incident.position, reference.position)
    for i in range(number):
        put(polygon[i].point, add(vec(polygon[i].point), offset))
        names[i].feature_id = polygon[i].feature_id
        polygon[i].feature_id = corner_id(incident, incident_face, i)
    number = clip_polygon(corners, count, n, polygon, number, points)
    normal = face_normal(reference, face)
    origin, cosine = vec(corners[0].point), dot(normal, n)
    has_hull = incident.kind == HULL or reference.kind == HULL
    for i in range(number):
        vertex, side = polygon[i], polygon[i - 1 if i > 0 else number - 1].feature_id
        height = dot(normal, sub(vec(vertex.point), origin)) / cosine
        put(points[i].point, add_scaled(
            add(reference.position, vec(vertex.point)), -(height / 2), n))
        points[i].gap = sign * height
        corner = vertex.feature_id
        if incident.kind == HULL and corner < MAX_CORNERS:
            corner = names[corner].feature_id
        points[i].feature_id = _feature_id(
            has_hull, face, incident_face, 1 if sign > 0 else 0, side, vertex.feature_id, corner)
    return number


@compiled
def _feature_id(has_hull: bool, face: int, incident_face: int, of_b: int, side: int, end: int,
                corner: int) -> int:
    """Pack the id of a contact point on the reference face ``face``, which is b's where ``of_b`` is
    1: from both faces and the sides of the clipped polygon before and after the point, ``side`` and
    ``end``. If both are sides of the incident face, the point is its ``corner``: from the reference
    face and ``corner`` alone. ``has_hull``: whether one of the shapes is a hull.
    """
    is_corner = side < MAX_CORNERS and end < MAX_CORNERS
    if not has_hull:
        face += 6 * of_b
        if is_corner:
            return CORNER_IDS + face * MAX_CORNERS + corner
        return ((face * 6 + incident_face) * 2 * MAX_CORNERS + side) * 2 * MAX_CORNERS + end
    face = face % MAX_FACES + MAX_FACES * of_b
    if is_corner:
        return HULL_CORNER_IDS + face * MAX_VERTICES + corner % MAX_VERTICES
    faces = face * MAX_FACES + incident_face % MAX_FACES
    return FIRST_HULL_ID + (faces * 2 * MAX_CORNERS + side) * 2 * MAX_CORNERS + end


@compiled
def supporting_edges(a: Shape, b: Shape, n: Vec3) -> tuple[Vec3, Vec3, Vec3, Vec3]:
    """Supporting edges, or lines on the sides of cylinders, of a along -n and of b along n.

    Returns midpoint and half vector of a's, then of b's, m; midpoints from b's center.
    """
    middle, u = supporting_edge(a, neg(n))
    other, v = supporting_edge(b, n)
    return add(middle, a.position), u, other, v


@compiled
def clip_edges(middle: Vec3, u: Vec3, other: Vec3, v: Vec3, n: Vec3, points: np.ndarray) -> int:
    """Write to ``points`` the ends of the overlap of two edges seen along n, midway between them,
    with their gaps, and 0 and 1 as feature ids. The edges are ``middle`` +- u and ``other`` +- v,
    as of supporting_edges(). Returns 2; 0 if they are not parallel or do not overlap.
    """
    offset = sub(middle, other)
    rise, other_rise = dot(u, n), dot(v, n)
    uu, vv = dot(u, u) - rise * rise, dot(v, v) - other_rise * other_rise
    uv = dot(u, v) - rise * other_rise
    if uu <= 0 or vv <= 0 or uu * vv - uv * uv > (
            PARALLEL_EDGES_SINE * PARALLEL_EDGES_SINE * uu * vv):
        return 0
    height = dot(offset, n)
    rise_offset = dot(offset, v) - height * other_rise
    # a's points offset + t u are above b's at (along + t uv) / vv of v
    ends = (vv - rise_offset) / uv, (-vv - rise_offset) / uv
    lo, hi = max(min(ends[0], ends[1]), -1.0), min(max(ends[0], ends[1]), 1.0)
    if lo > hi:
        return 0
    for k in range(2):
        t = lo if k == 0 else hi
        gap = height + t * rise - (rise_offset + t * uv) / vv * other_rise
        put(points[k].point, add_scaled(
            add_scaled(add(other, offset), t, u), -(gap / 2), n))
        points[k].gap, points[k].feature_id = gap, k
    return 2


@compiled
def closest_on_edges(middle: Vec3, u: Vec3, other: Vec3, v: Vec3, n: Vec3, s: float) -> Vec3:
    """Midpoint, m, of the closest points of the edges ``middle`` +- u, of a, and ``other`` +- v, of
    b, that are s apart along n, from b to a. Of a vertex u or v is 0. The origin of the result is
    that of ``middle`` and ``other``.
    """
    offset = sub(other, middle)
    rise, other_rise, height = dot(u, n), dot(v, n), dot(offset, n)
    uu, vv = dot(u, u) - rise * rise, dot(v, v) - other_rise * other_rise
    uv = dot(u, v) - rise * other_rise
    du, dv = dot(offset, u) - height * rise, dot(offset, v) - height * other_rise
    t = 0.0
    if uu > 0 and vv > 0:
        # the closest points of two segments, seen along n: Ericson 5.1.9
        square = uu * vv - uv * uv
        t = (du * vv - dv * uv) / square if square > 1e-12 * uu * vv else 0.0
        t = min(max(t, -1.0), 1.0)
        e = min(max((t * uv - dv) / vv, -1.0), 1.0)
        t = min(max((du + e * uv) / uu, -1.0), 1.0)
    if uu > 0 and vv <= 0:
        return add_scaled(other, s / 2, n)
    return add_scaled(add_scaled(middle, t, u), -s / 2, n)
