"""Rounds what is dragged to whole steps: poses from where the drag began, sizes and joint angles
from zero.
"""
from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ....model import rotation

LENGTH, ANGLE = 0.01, math.radians(5)
"""m, rad: the steps."""


def snapped_position(new: Sequence[float], old: Sequence[float],
                     orientation: Sequence[float]) -> np.ndarray:
    """Position (3,) m in whole steps from ``old``, along the axes of ``orientation`` (4,)."""
    shift = rotation.rotate(rotation.inverse(orientation), np.subtract(new, old))
    return old + rotation.rotate(orientation, LENGTH * np.round(shift / LENGTH))


def snapped_orientation(new: Sequence[float], old: Sequence[float]) -> np.ndarray:
    """Turn orientation ``old`` (4,) by whole steps about the axis of the rotation to ``new``."""
    turn = rotation.rotation_vector(rotation.multiply(new, rotation.inverse(old)))
    angle = float(np.linalg.norm(turn))
    if angle < ANGLE / 2:
        return np.array(old)
    turn = turn * (snapped_angle(angle) / angle)
    return rotation.multiply(rotation.from_rotation_vector(turn), old)


def snapped_half_extents(new: np.ndarray, old: np.ndarray) -> np.ndarray:
    """Half extents (3,) m of edges in whole steps, one at least; unchanged ones stay."""
    edges = LENGTH * np.maximum(np.round(2 * new / LENGTH), 1)
    return np.where(new == old, old, edges / 2)


def snapped_angle(angle: float) -> float:
    """Angle, rad, in whole steps."""
    return ANGLE * round(angle / ANGLE)
