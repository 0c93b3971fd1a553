"""A free rigid body, from Euler's equations I w' = (I w) x w along its own axes."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...model import rotation
from .integration import integrate


def torque_free_rotation(inertia: Sequence[float], omega: Sequence[float],
           times: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    """Orientations (t, 4) and angular velocities (t, 3) rad/s in the body's frame.

    ``inertia`` are the principal moments, ``omega`` the first angular velocity along the
    principal axes, which are the world's at the start. DOP853 at 1e-12.
    """
    moments = np.array(inertia, float)

    def derivative(t: float, y: np.ndarray) -> np.ndarray:
        q, w = y[:4], y[4:]
        turn = rotation.multiply(q, np.append(w, 0.0)) / 2
        return np.concatenate([turn, np.cross(moments * w, w) / moments])

    start = np.concatenate([rotation.IDENTITY, omega])
    rows = integrate(derivative, start, times)
    return rotation.normalized(rows[:, :4]), rows[:, 4:]
