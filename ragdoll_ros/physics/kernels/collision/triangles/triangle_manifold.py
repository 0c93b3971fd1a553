"""Contact manifold of a shape and a triangle of a surface.

On the triangle's face a's own face, edge or vertex is clipped by the triangle's sides. Points that
an edge cuts off are left out where the surface goes on, flat or bent up: the next triangle has
them. At an edge or corner of the triangle, a's face clips it, or two edges touch.
"""
from __future__ import annotations


import numpy as np

from ...compiling.decorators import compiled
from ...maths.vectors import (Vec3, add, add_scaled, column, cross, dot, neg, norm, put, scale, sub,
                              vec)
from ..clipping import MAX_CLIPPED, clip_polygon
from ..convex_manifold import FACE_COSINE, MERGE_RATIO, clip_edges, closest_on_edges
from ..features import (FEATURE_SINE, MAX_CORNERS, corner_id, face_cosine, face_normal,
                        supporting_edge, supporting_face)
from ..manifold import CLIP_VERTEX, merge_points, reduce_points, sort_points
from ..separating_axis import FACE_BIAS, FACE_BIAS_RATIO
from ..shapes import BOX, CAPSULE, HULL, SPHERE, Shape, bounding_radius
from .limited_axis import (FACE, FIRST_CORNER, LimitedAxis, core_radius, is_beside,
                           is_contact_axis, limited_axis, triangle_lower_bounds)
from .triangle import FLAT, Corners, corners_of, edge_vectors, supporting_corner

WIDER = 1 + 1e-9
"""Scale of the triangle that clips, so that a point on the edge between two is on both."""

OVERLAP = 1e-3
"""m: by which triangles overlap where the surface bends up; the next face is higher there, so that
nothing touches this one beyond the edge that does not touch that one as well."""

ON_FACE = 1 << 16
"""Feature ids of points on the triangle's face that are vertices of a: below this."""

FACE_IDS, REFERENCE_IDS, CLOSEST_ID = ON_FACE, ON_FACE + 1024, ON_FACE + 2048
"""First feature ids of others on the triangle's face, and on a's face; the id of the closest."""


@compiled
def triangle_manifold(a: Shape, t: Shape, margin: float, manifold: np.ndarray) -> int:
    """Write the manifold of a shape and a triangle; arguments and return value as collide()."""
    if a.kind == HULL:
        height, beside = triangle_lower_bounds(a, t)
        if max(height, beside - OVERLAP) > margin:
            return 0
    found, radius = limited_axis(a, t), core_radius(a)
    if found.allowed - radius > margin or is_beside(found, radius):
        return 0
    scratch = np.empty(2 * MAX_CLIPPED + 2 * MAX_CORNERS, CLIP_VERTEX)
    points = scratch[MAX_CLIPPED:2 * MAX_CLIPPED]
    corners, arm = corners_of(t), sub(a.position, t.position)
    s, n, feature = found.allowed, found.axis, found.feature
    if a.kind >= BOX and s < found.face + FACE_BIAS + FACE_BIAS_RATIO * abs(s):
        s, n, feature = found.face, found.normal, FACE
    if feature == FACE:
        count, clipped = clip_by_triangle(a, arm, corners, found, scratch)
    elif a.kind >= BOX and face_cosine(a, neg(n)) >= FACE_COSINE:
        count = clipped = clip_triangle(a, arm, corners, n, scratch)
    else:
        middle, u = a_edge(a, arm, n)
        other, v = triangle_edge(corners, feature)
        count = clipped = clip_edges(middle, u, other, v, n, points)
    if clipped == 0 and is_contact_axis(found):
        middle, u = a_edge(a, arm, n)
        if feature == FACE:
            middle = add_scaled(middle, -s / 2, n)
        else:
            other, v = triangle_edge(corners, feature)
            middle = closest_on_edges(middle, u, other, v, n, s)
        put(points[0].point, middle)
        points[0].gap, points[0].feature_id = s, CLOSEST_ID
        count = 1
    distance = MERGE_RATIO * min(bounding_radius(a), bounding_radius(t))
    count = reduce_points(points, merge_points(points, count, margin + radius, distance))
    sort_points(points, count)
    for i in range(count):
        contact, point = manifold[i], points[i]
        put(contact.point, add(t.position, add_scaled(vec(point.point), -radius / 2, n)))
        put(contact.normal, n)
        contact.gap, contact.feature_id = point.gap - radius, point.feature_id
    return count


@compiled
def a_edge(a: Shape, arm: Vec3, n: Vec3) -> tuple[Vec3, Vec3]:
    """Middle, m, from the triangle's centroid, and half vector of the edge or line of a's core that
    supports against n; the half of a point is 0. ``arm``: a's center.
    """
    if a.kind == SPHERE:
        return arm, (0.0, 0.0, 0.0)
    if a.kind == CAPSULE:
        half = scale(a.size[1], column(a.rotation, 2))
        rise = dot(column(a.rotation, 2), n)
        if abs(rise) < FEATURE_SINE:
            return arm, half
        return add_scaled(arm, -1.0 if rise > 0 else 1.0, half), (0.0, 0.0, 0.0)
    middle, half = supporting_edge(a, neg(n))
    return add(arm, middle), half


@compiled
def triangle_edge(corners: Corners, feature: int) -> tuple[Vec3, Vec3]:
    """Midpoint and half of the vector, m, of an edge, feature 0 to 2; of a corner, from
    FIRST_CORNER on, the corner and 0.
    """
    if feature >= FIRST_CORNER:
        return corners[feature - FIRST_CORNER], (0.0, 0.0, 0.0)
    begin, end = corners[feature], corners[(feature + 1) % 3]
    return scale(0.5, add(begin, end)), scale(0.5, sub(end, begin))


@compiled
def put_corners(corners: Corners, factor: float, out: np.ndarray) -> None:
    """Write the corners of a triangle, scaled by ``factor`` about the centroid, to ``out`` (4,),
    with feature ids 0 to 3. The last corner is written twice: a reference polygon of clip_polygon()
    must have an even number of sides.
    """
    for k in range(4):
        put(out[k].point, scale(factor, corners[min(k, 2)]))
        out[k].feature_id = k


@compiled
def widen(corners: Corners, edges: Vec3, out: np.ndarray) -> None:
    """Move the sides of a triangle in ``out``, as put_corners() wrote it, outwards by OVERLAP where
    the surface bends up. Else a corner of a in the valley would be clipped off: it is below both
    faces, but beside each.
    """
    directions = edge_vectors(corners)
    for k in range(3):
        before = (k + 2) % 3
        wide, wide_before = edges[k] < -FLAT, edges[before] < -FLAT
        if not wide and not wide_before:
            continue
        onward, into = directions[k], directions[before]
        # Both sides at the corner are as far apart as the sine between them says.
        sine = norm(cross(into, onward))
        offset = add(scale(OVERLAP / sine if wide else 0.0, into),
                     scale(-OVERLAP / sine if wide_before else 0.0, onward))
        put(out[k].point, add(vec(out[k].point), offset))
    put(out[3].point, vec(out[2].point))


@compiled
def clip_by_triangle(a: Shape, arm: Vec3, corners: Corners, found: LimitedAxis,
                     scratch: np.ndarray) -> tuple[int, int]:
    """Clip the face, edge or vertex of a's core that supports against found.normal by the triangle.
    Writes the points, midway in the gap, to ``scratch`` from MAX_CLIPPED on, without those at flat
    or concave edges, which the next triangle has; a corner of a flat face that consists of several
    triangles is kept by one of them. Returns the number of points, and the number before any were
    left out. ``arm``: a's center from the triangle's, m.
    """
    polygon, points = scratch[:MAX_CLIPPED], scratch[MAX_CLIPPED:2 * MAX_CLIPPED]
    sides, names = (scratch[2 * MAX_CLIPPED:2 * MAX_CLIPPED + MAX_CORNERS],
                    scratch[2 * MAX_CLIPPED + MAX_CORNERS:])
    n, number, face = found.normal, 0, 0
    if a.kind <= CAPSULE:
        number, half = (1, 0.0) if a.kind == SPHERE else (2, a.size[1])
        for i in range(number):
            put(polygon[i].point, scale(half if i else -half, column(a.rotation, 2)))
    else:
        number, face = supporting_face(a, neg(n), (0.0, 0.0, 0.0), polygon)
    for i in range(number):
        put(polygon[i].point, add(vec(polygon[i].point), arm))
        names[i].feature_id = polygon[i].feature_id
        polygon[i].feature_id = corner_id(a, face, i)
    put_corners(corners, WIDER, sides)
    widen(corners, found.edges, sides)
    number = clip_polygon(sides, 4, n, polygon, number, points)
    count = 0
    for i in range(number):
        vertex, before = polygon[i], polygon[i - 1 if i > 0 else number - 1].feature_id
        is_corner = before >= MAX_CORNERS and vertex.feature_id >= MAX_CORNERS
        if is_flat_or_concave(found.edges, vertex.feature_id) or (
                is_flat_or_concave(found.edges, before) and not is_corner):
            continue
        height = dot(n, vec(vertex.point))
        put(points[count].point, add_scaled(vec(vertex.point), -(height / 2), n))
        points[count].gap = height
        points[count].feature_id = FACE_IDS + before * 2 * MAX_CORNERS + vertex.feature_id
        if before < MAX_CORNERS and vertex.feature_id < MAX_CORNERS:
            corner = vertex.feature_id
            points[count].feature_id = names[corner].feature_id if a.kind == HULL else corner
        count += 1
    return count, number


@compiled
def is_flat_or_concave(edges: Vec3, side: int) -> bool:
    """Whether ``side``, an id of clip_polygon(), is one of the triangle's sides, from MAX_CORNERS
    on, and its edge flat or concave. ``edges``: bend at each side, positive where convex.
    """
    return side >= MAX_CORNERS and not edges[min(side - MAX_CORNERS, 2)] > FLAT


@compiled
def clip_triangle(a: Shape, arm: Vec3, corners: Corners, n: Vec3, scratch: np.ndarray) -> int:
    """Contact points of a face of a, which clips the triangle: that of a box, cylinder or hull that
    is farthest along -n; n: unit contact axis, from the triangle to a.

    Coordinates are along world axes, relative to the triangle's center, m; ``arm``: a's center.
    Writes the points, halfway in the gap, with their gaps, m, and feature ids to ``scratch`` from
    MAX_CLIPPED on. Returns their number.
    """
    polygon, points = scratch[:MAX_CLIPPED], scratch[MAX_CLIPPED:2 * MAX_CLIPPED]
    sides = scratch[2 * MAX_CLIPPED:2 * MAX_CLIPPED + MAX_CORNERS]
    put_corners(corners, 1.0, polygon)
    nearest = sub(corners[supporting_corner(corners, n)], arm)
    number, face = supporting_face(a, neg(n), nearest, sides)
    if number % 2:
        sides[number] = sides[number - 1]
        number += 1
    for i in range(number):
        put(sides[i].point, add(vec(sides[i].point), arm))
    origin = vec(sides[0].point)
    number = clip_polygon(sides, number, n, polygon, 3, points)
    normal = face_normal(a, face)
    cosine = dot(normal, n)
    for i in range(number):
        vertex, before = polygon[i], polygon[i - 1 if i > 0 else number - 1].feature_id
        height = dot(normal, sub(origin, vec(vertex.point))) / cosine
        put(points[i].point, add_scaled(vec(vertex.point), height / 2, n))
        points[i].gap = height
        points[i].feature_id = REFERENCE_IDS + before * 2 * MAX_CORNERS + vertex.feature_id
    return number
