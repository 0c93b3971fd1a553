"""From REP 103's axes to glTF's (2.0, 3.4) and BVH's: Y up, facing +Z, left at +X.

(x, y, z) there is (y, z, x) here: a rotation, so that quaternions' vector parts change likewise.
"""
from __future__ import annotations

import numpy as np


def points_y_up(points: np.ndarray) -> np.ndarray:
    """Points or vectors (..., 3) with Y up."""
    return np.asarray(points)[..., [1, 2, 0]]


def orientations_y_up(orientations: np.ndarray) -> np.ndarray:
    """Quaternions (..., 4) x, y, z, w with Y up."""
    return np.asarray(orientations)[..., [1, 2, 0, 3]]
