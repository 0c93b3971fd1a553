"""From REP 103's axes to those of files for animators: Y up, facing +Z, the left at +X.

So has them glTF 2.0 (3.4, coordinate system and units), and so have most BVH files. (x, y, z) there
is (y, z, x) here: a rotation, so that the vector parts of quaternions change in the same way.
"""
from __future__ import annotations

import numpy as np


def points_y_up(points: np.ndarray) -> np.ndarray:
    """Points or vectors (..., 3), x forward, y left, z up, with Y up; in the same unit."""
    return np.asarray(points)[..., [1, 2, 0]]


def orientations_y_up(orientations: np.ndarray) -> np.ndarray:
    """Quaternions (..., 4) x, y, z, w of the same rotations with Y up."""
    return np.asarray(orientations)[..., [1, 2, 0, 3]]
