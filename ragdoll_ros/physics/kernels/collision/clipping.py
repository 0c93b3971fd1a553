"""Sutherland-Hodgman clipping: a polygon clipped by the sides of a convex polygon.

Sutherland, Hodgman, Reentrant polygon clipping, 1974.
"""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled
from ..maths.vectors import Vec3, add_scaled, cross, dot, put, scale, sub, vec
from .features import MAX_CORNERS

MAX_CLIPPED = 20
"""Vertices of a clipped polygon: 8 of a cap, 8 sides, and a few that rounding may add."""


@compiled
def clip_polygon(reference: np.ndarray, reference_count: int, n: Vec3, polygon: np.ndarray,
                 polygon_count: int, scratch: np.ndarray) -> int:
    """Clip ``polygon`` (polygon_count) in place by the sides of the convex polygon ``reference``,
    seen along n. Returns the number of vertices left. All are CLIP_VERTEX; ``reference_count`` must
    be even, as each side swaps polygon and ``scratch``, both (MAX_CLIPPED,). A vertex has the
    feature id of the side that leaves it: 0 to 7 the polygon's, from MAX_CORNERS on the
    reference's.
    """
    turn = _winding(reference, n)
    source, target = polygon, scratch
    for j in range(reference_count):
        k = j + 1 if j + 1 < reference_count else 0
        corner = vec(reference[j].point)
        # the side's plane holds n; inside is m x <= m corner
        m = scale(turn, cross(sub(vec(reference[k].point), corner), n))
        polygon_count = _clip_by_plane(source, polygon_count, m, dot(m, corner), MAX_CORNERS + j,
                                       target)
        source, target = target, source
        if polygon_count == 0:
            break
    return polygon_count


@compiled
def _winding(corners: np.ndarray, n: Vec3) -> float:
    """1 if the corners run anticlockwise about n, else -1."""
    origin = vec(corners[0].point)
    a, b = sub(vec(corners[1].point), origin), sub(vec(corners[2].point), origin)
    return 1.0 if dot(n, cross(a, b)) > 0 else -1.0


@compiled
def _clip_by_plane(polygon: np.ndarray, polygon_count: int, m: Vec3, offset: float, side: int,
                   out: np.ndarray) -> int:
    """Write the part of a polygon with m x <= ``offset`` to ``out``; its new side gets the feature
    id ``side``. Returns its number of vertices, at most MAX_CLIPPED.
    """
    count = 0
    previous = polygon[polygon_count - 1]
    before = dot(m, vec(previous.point)) - offset
    for i in range(polygon_count):
        vertex = polygon[i]
        now = dot(m, vec(vertex.point)) - offset
        if (now <= 0) != (before <= 0) and count < MAX_CLIPPED:
            start = vec(previous.point)
            put(out[count].point, add_scaled(
                start, before / (before - now), sub(vec(vertex.point), start)))
            out[count].feature_id = previous.feature_id if now <= 0 else side
            count += 1
        if now <= 0 and count < MAX_CLIPPED:
            put(out[count].point, vec(vertex.point))
            out[count].feature_id = vertex.feature_id
            count += 1
        previous, before = vertex, now
    return count
