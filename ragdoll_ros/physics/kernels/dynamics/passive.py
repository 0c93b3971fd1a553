"""Passive elastic torques on joint angles: double exponentials, see model/passive.py."""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled
from ..maths.transcendental import exp_minus

STEEPEST = 40.0
"""Largest exponent, as in model/passive.py."""


@compiled
def passive_torque(body: np.record, axis: int, angle: float) -> tuple[float, float, float]:
    """Return the passive torque, N m, about axis ``axis`` of the joint of ``body`` at ``angle``,
    rad; its stiffness, minus the derivative of the torque, N m/rad; and the elastic energy, J.
    """
    torque = stiffness = energy = 0.0
    for end in range(2):
        sign = 1.0 - 2.0 * end
        rate = body.passive_rates[axis, end]
        if rate == 0.0:
            continue
        exponent = min(sign * (body.passive_angles[axis, end] - angle) * rate, STEEPEST)
        growth = exp_minus(exponent)[0] if exponent < 0 else 1 / exp_minus(-exponent)[0]
        size = body.passive_torques[axis, end] * growth
        torque += sign * size
        stiffness += size * rate
        energy += size / rate
    return torque, stiffness, energy
