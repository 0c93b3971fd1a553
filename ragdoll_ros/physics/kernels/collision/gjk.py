"""Closest points of two disjoint convex shapes: GJK.

Gilbert, Johnson, Keerthi, A fast procedure for computing the distance between complex objects in
three-dimensional space, 1988: the point nearest to the origin of the Minkowski difference, here
c - scale (b - a), a and b about their centers.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..maths.vectors import Vec3, add, add_scaled, cross, divide, dot, put, scale, sub, vec
from .shapes import Shape, opposite_point, support_point

MAX_ITERATIONS = 60
"""After which the best direction so far is taken; 5 to 20 are usual, most where rims meet."""

SIMPLEX_VERTEX = np.dtype([('point', float, 3), ('support', float, 3)], align=True)
"""A vertex of a simplex: point of the Minkowski difference, and the sum of the support points that
it is made of, which is independent of offset and scale."""

Direction = tuple[int, Vec3]
"""Number of vertices of the last simplex, and the unit vector from b to a."""

Nearest = tuple[float, Vec3, int]
"""Squared distance from the origin, the point, and the vertices it is made of, a bit each."""


@compiled
def closest_direction(a: Shape, b: Shape, c: Vec3, ratio: float, tolerance: float,
                      simplex: np.ndarray, count: int, n: Vec3) -> Direction:
    """Number of vertices of the last simplex, and the unit vector from b to a between the closest
    points of both shapes scaled by ``ratio`` about their centers. So scaled, they must be disjoint.

    c: offset of a's center from b's, m; ``tolerance``: relative error of the distance. The search
    starts along n with the first ``count`` vertices of an earlier ``simplex`` (4,), which is
    overwritten.
    """
    square, v = math.inf, n
    for k in range(count):
        put(simplex[k].point, add_scaled(c, -ratio, vec(simplex[k].support)))
    for step in range(MAX_ITERATIONS):
        if step > 0 or count == 0:
            support = add(opposite_point(a, n), support_point(b, n))
            point = add_scaled(c, -ratio, support)
            if step > 0 and square - dot(v, point) <= tolerance * square:
                break
            put(simplex[count].point, point)
            put(simplex[count].support, support)
            count += 1
        count, point = _nearest(simplex, count)
        found = dot(point, point)
        if found >= square or found <= 0:
            break
        square, v = found, point
        n = divide(v, math.sqrt(square))
    return count, n


@compiled
def _nearest(simplex: np.ndarray, count: int) -> tuple[int, Vec3]:
    """Reduce a simplex to the vertices of its point nearest to the origin. Returns their number and
    the point.

    In a tetrahedron that point is on a face, as the origin is outside, and not on that without the
    last vertex, which came because it was nearer.
    """
    if count == 1:
        return 1, vec(simplex[0].point)
    newest = count - 1
    if count == 2:
        square, point, subset = _nearest_on_segment(simplex, newest - 1, newest)
    else:
        square, point, subset = _nearest_on_triangle(simplex, newest - 2, newest - 1, newest)
    for k in range(1, count - 1 if count == 4 else 1):
        found, other, these = _nearest_on_triangle(simplex, newest - 3, k, newest)
        if found < square:
            square, point, subset = found, other, these
    number = 0
    for k in range(count):
        if subset & (1 << k):
            put(simplex[number].point, vec(simplex[k].point))
            put(simplex[number].support, vec(simplex[k].support))
            number += 1
    return number, point


@compiled
def _nearest_on_segment(simplex: np.ndarray, i: int, j: int) -> Nearest:
    """Nearest to the origin on the edge i j: squared distance, point, bits of the vertices used."""
    a = vec(simplex[i].point)
    edge = sub(vec(simplex[j].point), a)
    t, square = -dot(a, edge), dot(edge, edge)
    subset = (1 << i) | (1 << j)
    if t <= 0:
        t, subset = 0.0, 1 << i
    elif t >= square:
        t, subset = 1.0, 1 << j
    else:
        t /= square
    point = add_scaled(a, t, edge)
    return dot(point, point), point, subset


@compiled
def _nearest_on_triangle(simplex: np.ndarray, i: int, j: int, m: int) -> Nearest:
    """Nearest to the origin on the triangle i j m: squared distance, point, bits of the vertices
    used. A point inside is found along the normal, which is accurate in slivers too.
    """
    a, b, c = vec(simplex[i].point), vec(simplex[j].point), vec(simplex[m].point)
    n = cross(sub(b, a), sub(c, a))
    square = dot(n, n)
    if square > 0 and _inside(n, a, b) and _inside(n, b, c) and _inside(n, c, a):
        t = dot(a, n) / square
        return t * t * square, scale(t, n), (1 << i) | (1 << j) | (1 << m)
    best = _nearest_on_segment(simplex, i, j)
    other = _nearest_on_segment(simplex, j, m)
    if other[0] < best[0]:
        best = other
    other = _nearest_on_segment(simplex, i, m)
    if other[0] < best[0]:
        best = other
    return best


@compiled
def _inside(n: Vec3, a: Vec3, b: Vec3) -> bool:
    """Whether the origin is on the inner side of the edge a b of a triangle with normal n."""
    return dot(n, cross(a, sub(b, a))) > 0
