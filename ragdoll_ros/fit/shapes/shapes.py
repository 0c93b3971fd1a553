"""The smallest sphere, box, cylinder or capsule that holds most of a cluster of points."""
from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ...model.shapes import Box, Capsule, Cylinder, Shape, Sphere

TOLERANCE = 0.01
"""A vertex this far outside a body, m, still counts as inside."""

DECIMALS = 10
"""Decimals of m that a doll's numbers keep: below every figure of merit, above the noise."""

WANTED = 0.95
"""Share of a cluster's vertices that its body should hold."""

MOST_POINTS = 2000
"""Points on which shapes are tried; of larger clusters every n-th is taken."""

QUANTILES = (0.7, 0.8, 0.9, 0.95, 0.98, 1.0)
"""Shares of the points that a tried radius leaves inside."""

END_CUTS = np.array([0.0, 0.01, 0.02])
"""Shares of the points that a tried length leaves out at each end."""


@dataclass(frozen=True)
class Fitted:
    """A shape fitted to points."""

    shape: Shape
    centre: np.ndarray
    """(3,) m, in the frame that the points are given in."""
    share: float = 0.0
    """Of the points inside, to within the tolerance."""


def fit_shape(points: np.ndarray, kind: str, thinnest: float, tolerance: float) -> Fitted:
    """Shape of one kind around points (p, 3) m in its own axes, z the long one.

    The smallest of those tried that holds WANTED of the points, to within ``tolerance`` m, else
    the one that holds most. No edge is thinner than ``thinnest`` m, so that points in a plane, on
    a line, one or none have a body too.
    """
    points = points[::max(1, -(-len(points) // MOST_POINTS))]
    if len(points) == 0:
        points = np.zeros((1, 3))
    tried = []
    for fitted in sorted(MAKERS[kind](points, thinnest), key=lambda fitted: fitted.shape.volume):
        off = fitted.shape.signed_distance(points - fitted.centre)
        tried.append(replace(fitted, share=np.count_nonzero(off <= tolerance) / len(off)))
        if tried[-1].share >= WANTED:
            return tried[-1]
    return max(tried, key=lambda fitted: fitted.share)


def fit_best(clusters: list[np.ndarray], thinnest: float, tolerance: float) -> list[Fitted]:
    """Shapes of one kind around clusters (p, 3) m, each in its own axes; see fit_shape.

    The kind is the one that holds them in the smallest volume.
    """
    def badness(fits: list[Fitted]) -> tuple[bool, float]:
        return (min(fitted.share for fitted in fits) < WANTED,
                sum(fitted.shape.volume for fitted in fits))

    return min(([fit_shape(points, kind, thinnest, tolerance) for points in clusters]
                for kind in MAKERS), key=badness)


def extended(shape: Shape, point: np.ndarray) -> Fitted:
    """The shape, made as much larger as it takes to hold a point (3,) m of its own frame."""
    if isinstance(shape, Sphere):
        away = float(np.linalg.norm(point))
        grown = max(away - shape.radius, 0.0) / 2
        return Fitted(Sphere(shape.radius + grown), point * grown / max(away, 1e-12))
    half = np.array(shape.half_extents)
    if isinstance(shape, Box):
        low, high = np.minimum(-half, point), np.maximum(half, point)
        return Fitted(Box(tuple(high - low)), (low + high) / 2)
    across = float(np.hypot(*point[:2]))
    radius = max(shape.radius, across)
    # A capsule is so much longer at this distance from its axis.
    dome = np.sqrt(radius ** 2 - across ** 2) if isinstance(shape, Capsule) else 0.0
    low, high = min(-shape.length / 2, point[2] + dome), max(shape.length / 2, point[2] - dome)
    return Fitted(type(shape)(radius, high - low), np.array([0, 0, (low + high) / 2]))


def _boxes(points: np.ndarray, thinnest: float) -> Iterator[Fitted]:
    cuts = np.array([0.0, 0.005, 0.01, 0.02, 0.03, 0.045])
    for low, high in zip(*np.quantile(points, [cuts, 1 - cuts], axis=0), strict=True):
        yield Fitted(Box(tuple(np.maximum(high - low, thinnest))), (low + high) / 2)


def _spheres(points: np.ndarray, thinnest: float) -> Iterator[Fitted]:
    for centre in _centres(points):
        distances = np.linalg.norm(points - centre, axis=1)
        for radius in np.quantile(distances, QUANTILES):
            yield Fitted(Sphere(max(radius, thinnest / 2)), centre)


def _cylinders(points: np.ndarray, thinnest: float) -> Iterator[Fitted]:
    ends = np.quantile(points[:, 2], [END_CUTS, 1 - END_CUTS])
    for centre in _centres(points):
        radial = np.linalg.norm((points - centre)[:, :2], axis=1)
        for radius in np.quantile(radial, QUANTILES):
            for low, high in ends.T:
                middle = np.array([*centre[:2], (low + high) / 2])
                yield Fitted(Cylinder(max(radius, thinnest / 2), max(high - low, thinnest)), middle)


def _capsules(points: np.ndarray, thinnest: float) -> Iterator[Fitted]:
    for centre in _centres(points):
        radial = np.linalg.norm((points - centre)[:, :2], axis=1)
        radii = np.maximum(np.quantile(radial, QUANTILES), thinnest / 2)
        # A point at this distance from the axis is inside so far into the end's half ball.
        domes = np.sqrt(np.maximum(radii[:, None] ** 2 - radial ** 2, 0))
        lows = np.quantile(points[:, 2] + domes, END_CUTS, axis=1)
        highs = np.quantile(points[:, 2] - domes, 1 - END_CUTS, axis=1)
        for radius, *ends in zip(radii, lows.T, highs.T, strict=True):
            for low, high in zip(*ends, strict=True):
                middle = np.array([*centre[:2], (low + high) / 2])
                yield Fitted(Capsule(radius, max(high - low, thinnest / 2)), middle)


def _centres(points: np.ndarray) -> tuple[np.ndarray, ...]:
    """Two guesses at the middle: of the bounding box, and half way to the mean."""
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    return middle, (middle + points.mean(axis=0)) / 2


MAKERS = {'capsule': _capsules, 'box': _boxes, 'cylinder': _cylinders, 'sphere': _spheres}
