"""Supporting features of boxes, cylinders and hulls: a face, edge or vertex by its direction."""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..maths.vectors import (Vec3, add_scaled, column, dot, put, scale, to_local, to_world,
                             vec)
from .hulls.polyhedron import (face_polygon, hull_plane, supporting_hull_edge,
                               supporting_hull_face)
from .shapes import BOX, HULL, Shape

FEATURE_SINE = 0.1
"""Sine of the angle up to which a face, an edge or a line of a side is perpendicular to n."""

SIDE_COSINE = 0.7
"""Cosine between n and a cylinder's axis up to which its side, not a cap, supports."""

DIAGONAL = math.sqrt(0.5)
OCTAGON = np.array(((1, 0), (DIAGONAL, DIAGONAL), (0, 1), (-DIAGONAL, DIAGONAL),
                    (-1, 0), (-DIAGONAL, -DIAGONAL), (0, -1), (DIAGONAL, -DIAGONAL)))
MAX_CORNERS = len(OCTAGON)
"""Corners of a cap, on its rim; no face has more."""


@compiled
def supporting_face(shape: Shape, n: Vec3, t: Vec3, corners: np.ndarray) -> tuple[int, int]:
    """Write to ``corners`` the corners of the face that supports along the unit vector n (world),
    from the shape's center, m, world axes. Returns their number and the face's id. Box: 4. Hull: 3
    to 8; the feature ids are its vertices. Cylinder: the 2 ends of a line of its side, face 2, or
    the 8 corners of a cap: a regular octagon whose corner closest to the support point is moved to
    that point; if all of the cap supports, to the rim point farthest along ``t``.
    """
    size, (x, y, z) = shape.size, to_local(shape.rotation, n)
    if shape.kind == HULL:
        face = supporting_hull_face(shape.system, shape.hull, (x, y, z))
        count = face_polygon(shape.system, shape.hull, face, (x, y, z), MAX_CORNERS, corners)
        for k in range(count):
            put(corners[k].point, to_world(shape.rotation, vec(corners[k].point)))
        return count, face
    if shape.kind == BOX:
        return 4, _box_face(shape, (x, y, z), corners)
    across, end = math.sqrt(x * x + y * y), math.copysign(size[1], z)
    if abs(z) <= SIDE_COSINE:
        a, b = x * size[0] / across, y * size[0] / across
        put(corners[0].point, to_world(shape.rotation, (a, b, -size[1])))
        put(corners[1].point, to_world(shape.rotation, (a, b, size[1])))
        return 2, 2
    if across < 1e-9:
        x, y, _ = to_local(shape.rotation, t)
        across = math.sqrt(x * x + y * y)
    deepest = 0
    for k in range(1, MAX_CORNERS):
        if x * OCTAGON[k, 0] + y * OCTAGON[k, 1] > (
                x * OCTAGON[deepest, 0] + y * OCTAGON[deepest, 1]):
            deepest = k
    for k in range(MAX_CORNERS):
        a, b = OCTAGON[k, 0], OCTAGON[k, 1]
        if k == deepest and across > 1e-9:
            a, b = x / across, y / across
        put(corners[k].point, to_world(shape.rotation, (size[0] * a, size[0] * b, end)))
    return MAX_CORNERS, 0 if z > 0 else 1


@compiled
def _box_face(shape: Shape, n: Vec3, corners: np.ndarray) -> int:
    """Write the corners of the box's face that is farthest along n, relative to its center, world
    axes; n: in the box's frame. Returns the id of the face: 2 * axis, + 1 on the negative side.
    """
    size, axis, most = shape.size, 2, n[2]
    if abs(n[0]) > abs(most):
        axis, most = 0, n[0]
    if abs(n[1]) > abs(most):
        axis, most = 1, n[1]
    i, j = (axis + 1) % 3, (axis + 2) % 3
    middle = scale(math.copysign(size[axis], most), column(shape.rotation, axis))
    for k in range(4):
        a, b = size[i] * (1 if k == 0 or k == 3 else -1), size[j] * (1 if k < 2 else -1)
        edge = add_scaled(middle, a, column(shape.rotation, i))
        put(corners[k].point, add_scaled(edge, b, column(shape.rotation, j)))
    return axis * 2 + (1 if most < 0 else 0)


@compiled
def corner_id(shape: Shape, face: int, k: int) -> int:
    """Id, below MAX_CORNERS, of corner k of a face with this id, see supporting_face(): of a box
    the same on all three faces that share the corner, of other shapes k.
    """
    if shape.kind != BOX:
        return k
    axis = face // 2
    return ((1 - face % 2) << axis | (1 if k == 0 or k == 3 else 0) << (axis + 1) % 3
            | (1 if k < 2 else 0) << (axis + 2) % 3)


@compiled
def face_cosine(shape: Shape, n: Vec3) -> float:
    """Cosine between n (world) and the normal of a face: of a box the closest one, of a cylinder
    the closest cap's, of a hull that of supporting_hull_face().
    """
    x, y, z = to_local(shape.rotation, n)
    if shape.kind == HULL:
        face = supporting_hull_face(shape.system, shape.hull, (x, y, z))
        return dot(hull_plane(shape.system, face)[0], (x, y, z))
    return max(abs(x), abs(y), abs(z)) if shape.kind == BOX else abs(z)


@compiled
def face_normal(shape: Shape, face: int) -> Vec3:
    """Normal (world), inwards or outwards, of the face with this id of a box, hull or cylinder."""
    if shape.kind == HULL:
        return to_world(shape.rotation, hull_plane(shape.system, face)[0])
    return column(shape.rotation, face // 2 if shape.kind == BOX else 2)


@compiled
def supporting_edge(shape: Shape, n: Vec3) -> tuple[Vec3, Vec3]:
    """The edge, or line of a side, that supports along the unit vector n (world): its midpoint from
    the shape's center, and half of it as a vector, m, world axes; of a vertex or rim point the half
    is 0.
    """
    size, (x, y, z) = shape.size, to_local(shape.rotation, n)
    if shape.kind == HULL:
        middle, half = supporting_hull_edge(
            shape.system, shape.hull, (x, y, z), FEATURE_SINE)
        return to_world(shape.rotation, middle), to_world(shape.rotation, half)
    a, b, c, d, e, f = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if shape.kind == BOX:
        a, b, c = (math.copysign(size[0], x), math.copysign(size[1], y), math.copysign(size[2], z))
        least = min(abs(x), abs(y), abs(z))
        if least < FEATURE_SINE:
            if abs(x) == least:
                a, d = 0.0, size[0]
            elif abs(y) == least:
                b, e = 0.0, size[1]
            else:
                c, f = 0.0, size[2]
    else:
        across = math.sqrt(x * x + y * y)
        if across > 0:
            a, b = x * size[0] / across, y * size[0] / across
        if abs(z) < FEATURE_SINE:
            f = size[1]
        else:
            c = math.copysign(size[1], z)
    return to_world(shape.rotation, (a, b, c)), to_world(shape.rotation, (d, e, f))
