"""Simple shapes around a robot's mesh: one, or several where boxes show that one fits badly.

A part of a robot is solid and has been drawn along its axes, so that those count beside the
principal ones. What is hollow, a tray or a mug, is filled.
"""
from __future__ import annotations

import numpy as np

from ...model import rotation
from ...model.pose import Pose
from ...model.shapes import Shape
from ..shapes.axes import spread
from ..shapes.shapes import MAKERS, WANTED, Fitted, fit_shape

POINTS, FEW_POINTS = 2000, 400
"""On a mesh's surface, for its shapes and for where it is cut."""

MOST_SHAPES = 6
"""Of a mesh; each costs in contacts."""

WORTH = 0.3
"""A cut that saves less than this share of a box is not made."""

CUTS = np.arange(1, 16) / 16
"""Where a cut is tried, as shares of the extent along each axis."""

THINNEST, TOLERANCE = 0.01, 0.006
"""Of the mesh's extent: the least edge, and how far out a point still counts as inside."""

GAP = 0.05
"""Of a piece's extent: about how far its points are apart."""

LEAST = 0.001
"""m; no shape is thinner."""

ORDERS = [0, 1, 2], [1, 2, 0], [2, 0, 1]
"""Of three axes, so that each is z once."""


def fit_mesh(triangles: np.ndarray) -> list[tuple[Shape, Pose]]:
    """Shapes around triangles (t, 3, 3) m, with their poses in the mesh's frame."""
    points = surface_points(triangles, POINTS)
    extent = float(np.ptp(points, axis=0).max())
    thinnest = max(THINNEST * extent, LEAST)
    return [_smallest(piece, thinnest, TOLERANCE * extent)
            for piece in _pieces(points, thinnest)]


def surface_points(triangles: np.ndarray, count: int) -> np.ndarray:
    """Points (count, 3) spread evenly over triangles (t, 3, 3), the same ones each time."""
    a, b, c = triangles.transpose(1, 0, 2)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    # Of what is a line or a point, its corners.
    areas = areas if areas.sum() > 0 else np.ones(len(areas))
    steps = (np.arange(count) + 0.5) / count
    chosen = np.searchsorted(np.cumsum(areas) / areas.sum(), steps).clip(max=len(areas) - 1)
    # Roberts's R2 sequence, folded from the square into the triangle.
    u, v = (np.arange(count)[:, None] * (0.7548776662466927, 0.5698402909980532) % 1).T
    u, v = np.where(u + v > 1, (1 - u, 1 - v), (u, v))[:, :, None]
    return a[chosen] + u * (b - a)[chosen] + v * (c - a)[chosen]


def _smallest(points: np.ndarray, thinnest: float, tolerance: float) -> tuple[Shape, Pose]:
    """The smallest shape of any kind in any axes that holds the points, and its pose."""
    def badness(fitted: Fitted) -> tuple[bool, float]:
        return fitted.share < WANTED, fitted.shape.volume

    fits = [(fit_shape(points @ frame, kind, thinnest, tolerance), frame)
            for axes in _axes(points) for frame in (axes[:, order] for order in ORDERS)
            for kind in MAKERS]
    fitted, frame = min(fits, key=lambda pair: badness(pair[0]))
    return fitted.shape, Pose(frame @ fitted.centre, rotation.from_matrix(frame))


def _pieces(points: np.ndarray, thinnest: float) -> list[np.ndarray]:
    """Points (p, 3) cut in pieces, each time where boxes around them save most volume."""
    pieces, cuts = [points], [_best_cut(points, thinnest)]
    while len(pieces) < MOST_SHAPES:
        index = max(range(len(cuts)), key=lambda k: cuts[k][0])
        saved, normal, place = cuts[index]
        if saved <= 0:
            break
        halves = _halves(pieces[index], normal, place)
        pieces[index:index + 1] = halves
        cuts[index:index + 1] = [_best_cut(half, thinnest) for half in halves]
    return pieces


def _best_cut(points: np.ndarray, thinnest: float) -> tuple[float, np.ndarray, float]:
    """Volume, m^3, that a cut of points saves, its normal (3,) and place, m; 0 if not worth it."""
    few = points[::-(-len(points) // FEW_POINTS)]
    whole = _box(few, thinnest)
    best = WORTH * whole, np.zeros(3), 0.0
    for normal in np.concatenate([axes.T for axes in _axes(few)]):
        along = few @ normal
        low, high = along.min(), along.max()
        for place in low + CUTS * (high - low):
            parts = few[along < place], few[along >= place]
            if min(map(len, parts)) > 3:
                saved = whole - sum(_box(part, thinnest) for part in parts)
                best = max(best, (saved, normal, place), key=lambda cut: cut[0])
    return best if best[1].any() else (0.0, *best[1:])


def _box(points: np.ndarray, thinnest: float) -> float:
    """Volume of the smallest box around points, m^3."""
    return min(float(np.maximum(np.ptp(points @ axes, axis=0), thinnest).prod())
               for axes in _axes(points))


def _halves(points: np.ndarray, normal: np.ndarray, place: float) -> list[np.ndarray]:
    """Points on each side of a plane, those near it drawn out to it, so that no gap is left."""
    off = points @ normal - place
    near = np.abs(off) < GAP * np.ptp(points, axis=0).max()
    drawn = points - off[:, None] * normal
    return [np.concatenate([points[side], drawn[side & near]]) for side in (off < 0, off >= 0)]


def _axes(points: np.ndarray) -> list[np.ndarray]:
    """Axes (3, 3) as columns: the mesh's own, and the principal ones of the points."""
    _, principal = spread(points, np.ones(len(points)))
    return [np.eye(3), principal * (1, 1, np.linalg.det(principal))]
