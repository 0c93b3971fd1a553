"""Separating axes of boxes, cylinders and hulls (and of capsules' axes with them).

Along a unit vector n from b to a two convex shapes are separated by s(n) = c n - h_a(-n) - h_b(n),
c the offset of a's center from b's, h their support functions. The largest s over all n is positive
if and only if they are disjoint, and else minus their penetration depth.

Two boxes: it is along one of 15 axes, face normals and cross products of edges (SAT: Gottschalk,
Lin, Manocha, OBBTree, 1996). With a cylinder it may also be where a rim meets an edge or a rim. Of
a hull the faces are tried, and where it overlaps the products of its edges, which are many. Then
these axes are the start of two searches, both with GJK on disjoint shapes (gjk.py):

- of overlapping shapes the growth distance (Gilbert, Ong, 1994): the scale about their centers at
  which they touch; the axis there is the side to separate them to;
- separated along n by a small gap, their closest points give a better n. s never decreases, and a
  few of these steps end at a maximum.
"""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled
from ..maths.vectors import (Vec3, add_scaled, column, cross, divide, dot, neg, norm, to_local,
                             to_world)
from .gjk import SIMPLEX_VERTEX, Direction, closest_direction
from .hulls.polyhedron import (edge_vector, hull_edges, hull_faces, hull_plane,
                               is_supporting_edge)
from .shapes import BOX, CAPSULE, CYLINDER, HULL, Shape, bounding_radius, core_extent, half_width

PARALLEL_SINE = 1e-8
"""Sine between two edges below which face normals replace their cross product."""

FACE_BIAS, FACE_BIAS_RATIO = 1e-7, 0.02
"""m, and a part of s: how much better another axis must be than a face's normal. Between nearly
parallel faces rounding alone would choose; what is missed is less than a contact's slop."""

SHRINK_RATIO = 0.98
"""Of the scale at which shapes touch: small enough for well-defined closest points."""

DEEP_RATIO = 1e-3
"""Of the smaller bounding radius: a depth up to which the searches from the best face of a hull end
at the axis of largest separation. Bodies that rest are less deep in each other."""

GAP_RATIO = 1e-3
"""Of the shapes' size: the gap at which their closest points are computed."""

MAX_PENETRATION = 1e9
"""m: more than any penetration."""

COARSE_TOLERANCE, FINE_TOLERANCE = 1e-2, 1e-10
"""Relative error of GJK's distance, in the search of a side and in the refinement."""

Axis = tuple[float, Vec3]
"""Separation s, m, and the unit vector n from b to a, world."""


@compiled
def separation_along(a: Shape, b: Shape, c: Vec3, n: Vec3) -> float:
    """Separation s(n), m, along unit n; ``c``: offset of a's center from b's, m. A capsule counts
    as its axis, without its radius.
    """
    return dot(c, n) - core_extent(a, neg(n)) - core_extent(b, n)


@compiled
def face_or_edge_axis(a: Shape, b: Shape, c: Vec3, bias: float, cutoff: float) -> Axis:
    """SAT: find the Axis of largest separation among face normals and cross products of edges. With
    a hull, edges are only tried where the overlap is deep, see _hull_axis().

    The axis of a capsule a counts as an edge. A ``bias`` of 1, not 0, prefers a's faces to b's and
    these to edges. The first axis with a separation above ``cutoff`` ends the search; with a hull
    only a face's does. ``c``: offset of a's center from b's, m.
    """
    if a.kind == HULL or b.kind == HULL:
        return _hull_axis(a, b, c, bias, cutoff)
    s, axis = -MAX_PENETRATION, (0.0, 0.0, 0.0)
    first_a, first_b = 0 if a.kind == BOX else 2, 0 if b.kind == BOX else 2
    faces_a = 3 if a.kind == CAPSULE else first_a
    bar = -MAX_PENETRATION
    for body in range(2):
        rotation = a.rotation if body == 0 else b.rotation
        for k in range(faces_a if body == 0 else first_b, 3):
            n = _towards(c, column(rotation, k))
            found = dot(c, n) - half_width(a, n) - half_width(b, n)
            if found > s and found > bar:
                s, axis = found, n
                if s > cutoff:
                    return s, axis
        bar = s + bias * (FACE_BIAS + FACE_BIAS_RATIO * abs(s))
    for i in range(first_a, 3):
        for j in range(first_b, 3):
            n = cross(column(a.rotation, i), column(b.rotation, j))
            length = norm(n)
            if length < PARALLEL_SINE:
                continue
            n = _towards(c, divide(n, length))
            found = dot(c, n) - half_width(a, n) - half_width(b, n)
            if found > s and found > bar:
                s, axis = found, n
                if s > cutoff:
                    return s, axis
    return s, axis


@compiled
def _hull_axis(a: Shape, b: Shape, c: Vec3, bias: float, cutoff: float) -> Axis:
    """face_or_edge_axis() where a or b is a hull. The first face axis with a separation above
    ``cutoff`` ends the search. Edges are tried only if the best face axis overlaps by more than
    DEEP_RATIO times the smaller bounding radius. Faces of b must separate more than those of a, and
    edges more than faces, by ``bias`` * (FACE_BIAS + FACE_BIAS_RATIO * |best separation
    before|).
    """
    s, axis, bar = -MAX_PENETRATION, (0.0, 0.0, 0.0), -MAX_PENETRATION
    for body in range(2):
        own, other = (a, b) if body == 0 else (b, a)
        towards = neg(c) if body == 0 else c
        local = to_local(own.rotation, towards)
        first, end = _faces(own)
        for k in range(first, end):
            # The other's center is within it, so that it is no farther apart than its center.
            if own.kind == HULL:
                normal, offset = hull_plane(own.system, k)
                if dot(normal, local) - offset <= max(s, bar):
                    continue
            n, reach = _face(own, k, towards)
            found = dot(towards, n) - reach - core_extent(other, neg(n))
            if found > s and found > bar:
                s, axis = found, neg(n) if body == 0 else n
                if s > cutoff:
                    return s, axis
        bar = s + bias * (FACE_BIAS + FACE_BIAS_RATIO * abs(s))
    if s > -DEEP_RATIO * min(bounding_radius(a), bounding_radius(b)):
        return s, axis
    (first_a, end_a), (first_b, end_b) = _edges(a), _edges(b)
    for i in range(first_a, end_a):
        for j in range(first_b, end_b):
            n = cross(_edge(a, i), _edge(b, j))
            length = norm(n)
            if length < PARALLEL_SINE:
                continue
            for side in range(2):
                n = divide(n, length) if side == 0 else neg(n)
                if _supports(a, i, neg(n)) and _supports(b, j, n):
                    found = separation_along(a, b, c, n)
                    if found > s and found > bar:
                        s, axis = found, n
    return s, axis


@compiled
def _faces(shape: Shape) -> tuple[int, int]:
    """First of the face normals, and after the last; each of a box or cylinder is of two faces."""
    if shape.kind == HULL:
        return hull_faces(shape.system, shape.hull)
    return (0 if shape.kind == BOX else 3 if shape.kind == CAPSULE else 2), 3


@compiled
def _face(shape: Shape, k: int, towards: Vec3) -> tuple[Vec3, float]:
    """Face normal k, world, and the extent, m, of the shape along it. Of the two opposite normals
    of a box or cylinder it is the one that does not point against ``towards``.
    """
    if shape.kind == HULL:
        normal, offset = hull_plane(shape.system, k)
        return to_world(shape.rotation, normal), offset
    n = _towards(towards, column(shape.rotation, k))
    return n, core_extent(shape, n)


@compiled
def _edges(shape: Shape) -> tuple[int, int]:
    """First of the directions of edges, and after the last: of a cylinder or a capsule its axis."""
    if shape.kind == HULL:
        return hull_edges(shape.system, shape.hull)
    return (0 if shape.kind == BOX else 2), 3


@compiled
def _edge(shape: Shape, k: int) -> Vec3:
    """Direction k of an edge, world, of any length."""
    if shape.kind == HULL:
        return to_world(shape.rotation, edge_vector(shape.system, shape.hull, k))
    return column(shape.rotation, k)


@compiled
def _supports(shape: Shape, edge: int, n: Vec3) -> bool:
    """Whether an edge of a hull supports along n (world), which is perpendicular to it. True of
    other shapes.
    """
    return shape.kind != HULL or is_supporting_edge(
        shape.system, edge, to_local(shape.rotation, n))


@compiled
def needs_search(a: Shape, b: Shape) -> bool:
    """Whether another axis than face_or_edge_axis() finds may be the one of largest separation:
    where a rim touches, or edges of a hull.
    """
    return (a.kind == CYLINDER or b.kind == CYLINDER or a.kind == HULL or b.kind == HULL)


@compiled
def _towards(c: Vec3, n: Vec3) -> Vec3:
    """Return n or -n, whichever does not point against c."""
    return neg(n) if dot(n, c) < 0 else n


@compiled
def refine_axis(a: Shape, b: Shape, c: Vec3, start: Axis) -> Axis:
    """Improve ``start``, the best face or edge axis, until the separation along it no longer grows:
    by the growth distance where the shapes overlap, then by closest points. Returns the Axis of
    largest separation. ``c``: offset of a's center from b's, m.
    """
    # a bare 0 is a type of its own to numba, for which it would compile all once more
    simplex, count = np.empty(4, SIMPLEX_VERTEX), np.int64(0)
    gap = GAP_RATIO * (bounding_radius(a) + bounding_radius(b))
    s, axis = start
    if s < 0:
        count, n = _growth_axis(a, b, c, axis, simplex)
        found = separation_along(a, b, c, n)
        if found > s:
            s, axis = found, n
    for _ in range(20):
        offset = add_scaled(c, max(gap - s, 0.0), axis)
        count, n = closest_direction(a, b, offset, 1.0, FINE_TOLERANCE, simplex, count, axis)
        found = separation_along(a, b, c, n)
        if found <= s:
            break
        gain, s, axis = found - s, found, n
        if gain < 1e-13:
            break
    return s, axis


@compiled
def max_separation_axis(a: Shape, b: Shape, c: Vec3, cutoff: float) -> Axis:
    """Find the axis of largest separation of all, or one with a separation above ``cutoff``, m.
    Returns an Axis. ``c``: from b's center to a's, m.
    """
    start = face_or_edge_axis(a, b, c, 0.0, cutoff)
    if start[0] <= cutoff and needs_search(a, b):
        return refine_axis(a, b, c, start)
    return start


@compiled
def _growth_axis(a: Shape, b: Shape, c: Vec3, n: Vec3, simplex: np.ndarray) -> Direction:
    """Axis along which overlapping shapes touch when scaled: Dinkelbach's iteration from the guess
    n. Returns the number of vertices of ``simplex`` (4,), which is overwritten, and the axis.
    """
    largest, count, best = 0.0, np.int64(0), n
    for _ in range(6):
        offset = dot(c, n)
        growth = offset / (offset - separation_along(a, b, c, n))
        if growth <= 1.001 * largest:
            break
        largest, best = growth, n
        count, n = closest_direction(
            a, b, c, SHRINK_RATIO * growth, COARSE_TOLERANCE, simplex, count, n)
    return count, best
