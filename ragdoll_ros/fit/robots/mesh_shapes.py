"""Primitive shapes around a robot's mesh: one, or several where cuts save enough volume.

Parts of robots are solid and modelled along their axes, so those are tried beside the principal
axes. Hollow parts, such as trays and mugs, are filled.
"""
import numpy as np

from ...model import rotation
from ...model.pose import Pose
from ...model.shapes import Shape
from ..shapes.axes import principal_components
from ..shapes.fitting import CANDIDATES, MIN_COVERAGE, FittedShape, fit_shape

POINTS, CUT_POINTS = 2000, 400
"""Points sampled on a mesh's surface, for its shapes and for its cuts."""

MAX_SHAPES = 6
"""Shapes of a mesh; each adds contacts."""

MIN_SAVING = 0.3
"""Fraction of a box's volume that a cut must save."""

CUT_POSITIONS = np.arange(1, 16) / 16
"""Tried positions of cuts, as fractions of the extent along an axis."""

MIN_EDGE, INSIDE_TOLERANCE = 0.01, 0.006
"""Fractions of the mesh's extent: shortest edge, and distance of points counted as inside."""

POINT_SPACING = 0.05
"""Approximate spacing of the points, as a fraction of a part's extent."""

MIN_THICKNESS_M = 0.001
"""m; smallest thickness of a shape."""

AXIS_ORDERS = [0, 1, 2], [1, 2, 0], [2, 0, 1]
"""Cyclic permutations of the axes, so that each is z once."""


def fit_mesh(triangles: np.ndarray) -> list[tuple[Shape, Pose]]:
    """Shapes around triangles (t, 3, 3) m, with their poses in the mesh's frame."""
    points = surface_points(triangles, POINTS)
    extent = float(np.ptp(points, axis=0).max())
    thinnest = max(MIN_EDGE * extent, MIN_THICKNESS_M)
    return [_smallest(part, thinnest, INSIDE_TOLERANCE * extent)
            for part in _cut_points(points, thinnest)]


def surface_points(triangles: np.ndarray, count: int) -> np.ndarray:
    """Points (count, 3) evenly spread over triangles (t, 3, 3); deterministic."""
    a, b, c = triangles.transpose(1, 0, 2)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    # A degenerate mesh has no area: sample its triangles equally.
    areas = areas if areas.sum() > 0 else np.ones(len(areas))
    steps = (np.arange(count) + 0.5) / count
    chosen = np.searchsorted(np.cumsum(areas) / areas.sum(), steps).clip(max=len(areas) - 1)
    # Roberts's R2 sequence, folded from the square into the triangle.
    u, v = (np.arange(count)[:, None] * (0.7548776662466927, 0.5698402909980532) % 1).T
    u, v = np.where(u + v > 1, (1 - u, 1 - v), (u, v))[:, :, None]
    return a[chosen] + u * (b - a)[chosen] + v * (c - a)[chosen]


def _smallest(points: np.ndarray, thinnest: float, tolerance: float) -> tuple[Shape, Pose]:
    """The smallest shape of any kind and axes that contains MIN_COVERAGE of the points, and its
    pose; the smallest of all if none does.
    """
    def cost(fitted: FittedShape) -> tuple[bool, float]:
        return fitted.coverage < MIN_COVERAGE, fitted.shape.volume

    fits = [(fit_shape(points @ frame, kind, thinnest, tolerance), frame)
            for axes in _axes(points) for frame in (axes[:, order] for order in AXIS_ORDERS)
            for kind in CANDIDATES]
    fitted, frame = min(fits, key=lambda pair: cost(pair[0]))
    return fitted.shape, Pose(frame @ fitted.centre, rotation.from_matrix(frame))


def _cut_points(points: np.ndarray, thinnest: float) -> list[np.ndarray]:
    """Points (p, 3) split into parts, each time where boxes around the parts save most volume."""
    parts, cuts = [points], [_best_cut(points, thinnest)]
    while len(parts) < MAX_SHAPES:
        index = max(range(len(cuts)), key=lambda k: cuts[k][0])
        saved, normal, position = cuts[index]
        if saved <= 0:
            break
        halves = _halves(parts[index], normal, position)
        parts[index:index + 1] = halves
        cuts[index:index + 1] = [_best_cut(half, thinnest) for half in halves]
    return parts


def _best_cut(points: np.ndarray, thinnest: float) -> tuple[float, np.ndarray, float]:
    """Best cut: volume saved, m^3, unit normal (3,) and offset, m.

    The volume is 0 where no cut saves more than MIN_SAVING.
    """
    few = points[::-(-len(points) // CUT_POINTS)]
    whole = _box_volume(few, thinnest)
    best = MIN_SAVING * whole, np.zeros(3), 0.0
    for normal in np.concatenate([axes.T for axes in _axes(few)]):
        along = few @ normal
        low, high = along.min(), along.max()
        for position in low + CUT_POSITIONS * (high - low):
            parts = few[along < position], few[along >= position]
            if min(map(len, parts)) > 3:
                saved = whole - sum(_box_volume(part, thinnest) for part in parts)
                best = max(best, (saved, normal, position), key=lambda cut: cut[0])
    return best if best[1].any() else (0.0, *best[1:])


def _box_volume(points: np.ndarray, thinnest: float) -> float:
    """Volume, m^3, of the smallest box around points along one of the candidate axes."""
    return min(float(np.maximum(np.ptp(points @ axes, axis=0), thinnest).prod())
               for axes in _axes(points))


def _halves(points: np.ndarray, normal: np.ndarray, position: float) -> list[np.ndarray]:
    """Points on each side of a plane; nearby points are projected to it, so that no gap remains."""
    off = points @ normal - position
    near = np.abs(off) < POINT_SPACING * np.ptp(points, axis=0).max()
    drawn = points - off[:, None] * normal
    return [np.concatenate([points[side], drawn[side & near]]) for side in (off < 0, off >= 0)]


def _axes(points: np.ndarray) -> list[np.ndarray]:
    """Candidate axes (3, 3), as columns: the mesh's own, and the principal axes."""
    _, principal = principal_components(points, np.ones(len(points)))
    return [np.eye(3), principal * (1, 1, np.linalg.det(principal))]
