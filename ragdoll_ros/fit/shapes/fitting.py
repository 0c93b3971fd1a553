"""Smallest sphere, box, cylinder or capsule around most points of a cluster."""
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ...model.shapes import Box, Capsule, Cylinder, Shape, Sphere

TOLERANCE = 0.01
"""m; a vertex up to this far outside a body counts as inside."""

DECIMALS = 10
"""Decimals, in m, to which a doll's lengths are rounded: below any accuracy, above the noise."""

MIN_COVERAGE = 0.95
"""Fraction of a cluster's vertices that its shape should contain."""

MAX_POINTS = 2000
"""Points that candidates are tested with; larger clusters are subsampled."""

RADIUS_QUANTILES = (0.7, 0.8, 0.9, 0.95, 0.98, 1.0)
"""Fractions of the points within a candidate's radius."""

END_QUANTILES = np.array([0.0, 0.01, 0.02])
"""Fractions of the points beyond each end of a candidate."""


@dataclass(frozen=True)
class FittedShape:
    """A shape fitted to points."""

    shape: Shape
    centre: np.ndarray
    """(3,) m, in the frame of the points."""
    coverage: float = 0.0
    """Fraction of the points inside, to within the tolerance."""


def fit_shape(points: np.ndarray, kind: str, thinnest: float, tolerance: float) -> FittedShape:
    """Shape of one kind around points (p, 3) m in its own axes, z the long one.

    The smallest candidate that contains MIN_COVERAGE of the points to within ``tolerance`` m, else
    the candidate with the largest coverage. No edge is shorter than ``thinnest`` m, so that
    coplanar, collinear, single and missing points give a shape too.
    """
    points = points[::max(1, -(-len(points) // MAX_POINTS))]
    if len(points) == 0:
        points = np.zeros((1, 3))
    tried = []
    candidates = CANDIDATES[kind](points, thinnest)
    for fitted in sorted(candidates, key=lambda fitted: fitted.shape.volume):
        off = fitted.shape.signed_distance(points - fitted.centre)
        tried.append(replace(fitted, coverage=np.count_nonzero(off <= tolerance) / len(off)))
        if tried[-1].coverage >= MIN_COVERAGE:
            return tried[-1]
    return max(tried, key=lambda fitted: fitted.coverage)


def fit_best(clusters: list[np.ndarray], thinnest: float, tolerance: float) -> list[FittedShape]:
    """Shapes of the same kind around clusters (p, 3) m, each in its own axes; see fit_shape.

    The kind is the one with the smallest total volume, of those that contain MIN_COVERAGE of every
    cluster if there are any.
    """
    def cost(fits: list[FittedShape]) -> tuple[bool, float]:
        return (min(fitted.coverage for fitted in fits) < MIN_COVERAGE,
                sum(fitted.shape.volume for fitted in fits))

    return min(([fit_shape(points, kind, thinnest, tolerance) for points in clusters]
                for kind in CANDIDATES), key=cost)


def extend_to(shape: Shape, point: np.ndarray) -> FittedShape:
    """The shape, enlarged just enough to contain a point (3,) m of its own frame."""
    if isinstance(shape, Sphere):
        away = float(np.linalg.norm(point))
        grown = max(away - shape.radius, 0.0) / 2
        return FittedShape(Sphere(shape.radius + grown), point * grown / max(away, 1e-12))
    half = np.array(shape.half_extents)
    if isinstance(shape, Box):
        low, high = np.minimum(-half, point), np.maximum(half, point)
        return FittedShape(Box(tuple(high - low)), (low + high) / 2)
    across = float(np.hypot(*point[:2]))
    radius = max(shape.radius, across)
    # Height of a capsule's end cap at this distance from its axis.
    dome = np.sqrt(radius ** 2 - across ** 2) if isinstance(shape, Capsule) else 0.0
    low, high = min(-shape.length / 2, point[2] + dome), max(shape.length / 2, point[2] - dome)
    return FittedShape(type(shape)(radius, high - low), np.array([0, 0, (low + high) / 2]))


def _boxes(points: np.ndarray, thinnest: float) -> Iterator[FittedShape]:
    cuts = np.array([0.0, 0.005, 0.01, 0.02, 0.03, 0.045])
    for low, high in zip(*np.quantile(points, [cuts, 1 - cuts], axis=0), strict=True):
        yield FittedShape(Box(tuple(np.maximum(high - low, thinnest))), (low + high) / 2)


def _spheres(points: np.ndarray, thinnest: float) -> Iterator[FittedShape]:
    for centre in _centres(points):
        distances = np.linalg.norm(points - centre, axis=1)
        for radius in np.quantile(distances, RADIUS_QUANTILES):
            yield FittedShape(Sphere(max(radius, thinnest / 2)), centre)


def _cylinders(points: np.ndarray, thinnest: float) -> Iterator[FittedShape]:
    ends = np.quantile(points[:, 2], [END_QUANTILES, 1 - END_QUANTILES])
    for centre in _centres(points):
        radial = np.linalg.norm((points - centre)[:, :2], axis=1)
        for radius in np.maximum(np.quantile(radial, RADIUS_QUANTILES), thinnest / 2):
            for low, high in ends.T:
                middle = np.array([*centre[:2], (low + high) / 2])
                yield FittedShape(Cylinder(radius, max(high - low, thinnest)), middle)


def _capsules(points: np.ndarray, thinnest: float) -> Iterator[FittedShape]:
    for centre in _centres(points):
        radial = np.linalg.norm((points - centre)[:, :2], axis=1)
        radii = np.maximum(np.quantile(radial, RADIUS_QUANTILES), thinnest / 2)
        # Height of the end cap at each point's distance from the axis.
        domes = np.sqrt(np.maximum(radii[:, None] ** 2 - radial ** 2, 0))
        lows = np.quantile(points[:, 2] + domes, END_QUANTILES, axis=1)
        highs = np.quantile(points[:, 2] - domes, 1 - END_QUANTILES, axis=1)
        for radius, *ends in zip(radii, lows.T, highs.T, strict=True):
            for low, high in zip(*ends, strict=True):
                middle = np.array([*centre[:2], (low + high) / 2])
                yield FittedShape(Capsule(radius, max(high - low, thinnest / 2)), middle)


def _centres(points: np.ndarray) -> tuple[np.ndarray, ...]:
    """Candidate centres: of the bounding box, and half way from there to the mean."""
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    return middle, (middle + points.mean(axis=0)) / 2


CANDIDATES = {'capsule': _capsules, 'box': _boxes, 'cylinder': _cylinders, 'sphere': _spheres}
