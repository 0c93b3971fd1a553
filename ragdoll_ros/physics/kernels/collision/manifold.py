"""Contact manifolds: their points, and which of many are kept.

Gregorius, Robust contact creation for physics simulations, GDC 2015.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..maths.vectors import dot, put, sub, vec
from ..system import MAX_MANIFOLD_POINTS

CLIP_VERTEX = np.dtype([('point', float, 3), ('gap', float), ('feature_id', np.int64)], align=True)
"""A vertex of a polygon that is clipped, then a candidate for a point of a manifold."""


@compiled
def merge_points(points: np.ndarray, count: int, margin: float, distance: float) -> int:
    """Drop points whose gap exceeds ``margin``, m, and of two within ``distance``, m, the
    shallower, in place. Returns the number left.
    """
    kept = 0
    for i in range(count):
        if points[i].gap > margin:
            continue
        place = kept
        for k in range(kept):
            if _squared_distance(points[i], points[k]) < distance * distance:
                place = k
        if place == kept:
            kept += 1
        elif points[i].gap >= points[place].gap:
            continue
        points[place] = points[i]
    return kept


@compiled
def reduce_points(points: np.ndarray, count: int) -> int:
    """Keep at most MAX_MANIFOLD_POINTS: move to the front the deepest point, then repeatedly the
    farthest from all before it; fewer are left as they are. Returns the number kept.
    """
    if count <= MAX_MANIFOLD_POINTS:
        return count
    best = 0
    for i in range(count):
        if points[i].gap < points[best].gap:
            best = i
    for k in range(MAX_MANIFOLD_POINTS):
        if k > 0:
            best, farthest = k, -1.0
            for i in range(k, count):
                nearest = math.inf
                for j in range(k):
                    nearest = min(nearest, _squared_distance(points[i], points[j]))
                if nearest > farthest:
                    best, farthest = i, nearest
        _swap(points[k], points[best])
    return MAX_MANIFOLD_POINTS


@compiled
def sort_points(points: np.ndarray, count: int) -> None:
    """Sort points by feature id, in place, so that a patch has the same order in every step."""
    for i in range(1, count):
        for k in range(i, 0, -1):
            if points[k - 1].feature_id <= points[k].feature_id:
                break
            _swap(points[k - 1], points[k])


@compiled
def _swap(a: np.record, b: np.record) -> None:
    p, q = vec(a.point), vec(b.point)
    put(a.point, q)
    put(b.point, p)
    a.gap, b.gap = b.gap, a.gap
    a.feature_id, b.feature_id = b.feature_id, a.feature_id


@compiled
def _squared_distance(a: np.record, b: np.record) -> float:
    """Squared distance, m^2, between the points of two CLIP_VERTEX records."""
    difference = sub(vec(a.point), vec(b.point))
    return dot(difference, difference)
