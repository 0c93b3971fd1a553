"""A thin disc that slides and spins on its face under Coulomb's law with uniform pressure.

With a = v / (r w) the mean of |v + w x p| over the face is r w W(a), the mean distance of the
face's points from one at a radii from its centre:

    W = 4/(9 pi) [(7 + a^2) E - 4 (1 - a^2) K](a^2),                       a <= 1
    W = 4/(9 pi) [a (7 + a^2) E - (a^2 - 1) (a^2 + 3) / a K](1/a^2),       a >= 1

so friction dissipates the power mu m g (f v + t r w), f = dW/da and t = W - a f. Sliding and spin
stop at the same time, with a near 0.653 (Farkas, Bartels, Unger, Wolf, Phys. Rev. Lett. 90, 2003).
"""
from __future__ import annotations

import math

import numpy as np

from .integration import MAX_STEP, TOLERANCE

STOPPED = 1e-9
"""m/s: sum of sliding speed and r w below which the disc is at rest."""


def friction_factors(ratio: float) -> tuple[float, float]:
    """Force over mu m g, and torque over mu m g r, at v / (r w) = ``ratio``."""
    from scipy.special import ellipe, ellipk
    a = min(max(ratio, 1e-9), 1e6)
    k = min(a, 1 / a) ** 2
    e, f = ellipe(k), ellipk(k) if k < 1 else 0.0
    if a <= 1:
        mean = 4 / (9 * math.pi) * ((7 + a * a) * e - 4 * (1 - a * a) * f)
        force = 4 / (3 * math.pi * a) * ((1 + a * a) * e - (1 - a * a) * f)
    else:
        mean = 4 / (9 * math.pi) * (a * (7 + a * a) * e - (a * a - 1) * (a * a + 3) / a * f)
        force = 4 / (3 * math.pi) * ((1 + a * a) * e - (a * a - 1) * f)
    return force, mean - a * force


def slide_and_spin(radius: float, friction: float, gravity: float, speed: float, rate: float,
                   times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance (t,) m and rotation (t,) rad, from ``speed`` m/s and ``rate`` rad/s > 0."""
    from scipy.integrate import solve_ivp

    def derivative(_: float, y: np.ndarray) -> tuple[float, ...]:
        rim = radius * y[3]
        force, torque = friction_factors(y[2] / max(rim, 1e-300))
        return y[2], y[3], -friction * gravity * force, -2 * friction * gravity * torque / radius

    def stopped(_: float, y: np.ndarray) -> float:
        return y[2] + radius * y[3] - STOPPED
    stopped.terminal = True
    solved = solve_ivp(derivative, (times[0], times[-1]), (0.0, 0.0, speed, rate), 'DOP853',
                       events=stopped, dense_output=True, rtol=TOLERANCE, atol=TOLERANCE,
                       max_step=MAX_STEP)
    slid, angle, *_ = solved.sol(np.minimum(times, solved.t[-1]))
    return slid, angle
