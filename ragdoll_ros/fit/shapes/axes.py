"""Axes of a body from its vertices: along the principal axis, or along the bone."""
from dataclasses import dataclass

import numpy as np

MIN_ELONGATION = 0.2
"""Elongation from which on the first principal axis is used."""


@dataclass(frozen=True)
class Axes:
    """Axes of a body, and how they were chosen."""

    frame: np.ndarray
    """(3, 3), columns are the unit x, y and z axes, doll's frame; z is the long axis."""
    elongation: float
    """1 - s2 / s1 for the two largest standard deviations s1, s2: 0 for a sphere, 1 for a line."""
    principal: bool
    """Whether z is the first principal axis; else it is the bone's direction."""


def principal_components(points: np.ndarray, areas: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Standard deviations (3,) m, largest first, and the principal axes (3, 3) as columns.

    From the covariance of the points (p, 3) m about their mean, weighted by ``areas`` (p,) m^2.
    Zeros for fewer than two points.
    """
    if len(points) == 0:
        return np.zeros(3), np.eye(3)
    weights = areas if areas.sum() > 0 else np.ones(len(points))
    weights = weights / weights.sum()
    off = points - weights @ points
    values, vectors = np.linalg.eigh((off * weights[:, None]).T @ off)
    return np.sqrt(np.maximum(values[::-1], 0)), vectors[:, ::-1]


def fit_axes(points: np.ndarray, areas: np.ndarray, direction: np.ndarray,
             orientation: str = 'principal') -> Axes:
    """Axes of a cluster of vertices (p, 3) m with ``areas`` (p,) m^2, doll's frame.

    z is the first principal axis, with the sign of the bone's unit ``direction`` (3,); it is the
    direction itself for ``orientation`` 'bone' and for clusters with an elongation below
    MIN_ELONGATION. x is the first principal axis of the points projected along z, with the sign
    that faces forward (else left); where it is ambiguous, the perpendicular of z nearest to forward
    (left for z near forward).
    """
    deviations, vectors = principal_components(points, areas)
    elongation = 1 - deviations[1] / deviations[0] if deviations[0] > 1e-9 else 0.0
    principal = orientation == 'principal' and elongation >= MIN_ELONGATION
    z = vectors[:, 0] if principal else direction
    if z @ direction < 0:
        z = -z
    return Axes(_frame(z, points, areas), float(elongation), principal)


def _frame(z: np.ndarray, points: np.ndarray, areas: np.ndarray) -> np.ndarray:
    """Right-handed frame (3, 3) with a given unit z."""
    deviations, vectors = principal_components(points - np.outer(points @ z, z), areas)
    x = vectors[:, 0]
    if deviations[0] < 1e-9 or deviations[1] > 0.95 * deviations[0]:
        x = np.eye(3)[0] if abs(z[0]) < 0.9 else np.eye(3)[1]
    x = x - (x @ z) * z
    x = x / np.linalg.norm(x)
    lead = x[0] if abs(x[0]) > 1e-6 else x[1] if abs(x[1]) > 1e-6 else x[2]
    x = x if lead > 0 else -x
    return np.stack([x, np.cross(z, x), z], axis=1)
