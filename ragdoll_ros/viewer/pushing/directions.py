"""Directions of the arrow keys: horizontal and relative to a page's camera."""
from __future__ import annotations

import numpy as np

from ...model.vectors import Vector

SIDES = {'up': (1, 0), 'down': (-1, 0), 'right': (0, 1), 'left': (0, -1)}
"""How far away from the camera and how far to its right each arrow pushes."""

STEEP = 1e-3
"""Horizontal share of a line of sight below which the top of the picture is away."""


def seen_from(position: np.ndarray, look_at: np.ndarray,
              up: np.ndarray) -> dict[str, Vector]:
    """Unit vectors of the arrows, world frame, for a camera at ``position`` (3,) m.

    It looks at ``look_at`` (3,) m with ``up`` (3,) upwards in the picture.
    """
    gaze = np.asarray(look_at, float) - position
    away = gaze[:2]
    if np.linalg.norm(away) <= STEEP * np.linalg.norm(gaze):
        away = -np.sign(gaze[2]) * np.asarray(up, float)[:2]
    length = np.linalg.norm(away)
    away = away / length if length > 0 else np.array((-1.0, 0.0))
    right = np.array((away[1], -away[0]))
    return {arrow: (*(along * away + aside * right).tolist(), 0.0)
            for arrow, (along, aside) in SIDES.items()}
