"""Axes of a body from its cluster of vertices: along the principal axis, or along the bone."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

STANDS_OUT = 0.2
"""The first principal axis counts when the spread along it is this much above the second's."""


@dataclass(frozen=True)
class Axes:
    """Axes of a body and how they were found."""

    frame: np.ndarray
    """(3, 3) with the unit x, y and z axis, doll's frame, as columns; z is the long one."""
    distinct: float
    """1 - s2 / s1, with s1 and s2 the two largest standard deviations: 0 for a ball, 1 a line."""
    principal: bool
    """Whether z is the first principal axis (else the bone's direction)."""


def spread(points: np.ndarray, areas: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Standard deviations (3,) m, largest first, and the principal axes (3, 3) as columns.

    Roots of the eigenvalues and the eigenvectors of the covariance about the mean, in which each
    of the points (p, 3) m counts by the area (p,) m^2 it stands for. Up to one point: zeros.
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
    """Axes of a cluster (p, 3) m of vertices that stand for ``areas`` (p,) m^2, doll's frame.

    ``direction`` (3,), a unit vector, is the bone's: z for ``orientation`` 'bone', and where no
    principal axis stands out; else z is the first principal axis, its sign toward the direction.
    x is the principal axis across z, as near to forwards (then left) as its sign allows; where
    none stands out, the direction across z that is nearest to forwards.
    """
    deviations, vectors = spread(points, areas)
    distinct = 1 - deviations[1] / deviations[0] if deviations[0] > 1e-9 else 0.0
    principal = orientation == 'principal' and distinct >= STANDS_OUT
    z = vectors[:, 0] if principal else direction
    if z @ direction < 0:
        z = -z
    return Axes(_frame(z, points, areas), float(distinct), principal)


def _frame(z: np.ndarray, points: np.ndarray, areas: np.ndarray) -> np.ndarray:
    """Right-handed frame (3, 3) about a unit z."""
    deviations, vectors = spread(points - np.outer(points @ z, z), areas)
    x = vectors[:, 0]
    if deviations[0] < 1e-9 or deviations[1] > 0.95 * deviations[0]:
        x = np.eye(3)[0] if abs(z[0]) < 0.9 else np.eye(3)[1]
    x = x - (x @ z) * z
    x = x / np.linalg.norm(x)
    lead = x[0] if abs(x[0]) > 1e-6 else x[1] if abs(x[1]) > 1e-6 else x[2]
    x = x if lead > 0 else -x
    return np.stack([x, np.cross(z, x), z], axis=1)
