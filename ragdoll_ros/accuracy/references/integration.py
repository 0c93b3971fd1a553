"""One integrator for all references: DOP853 at 1e-12 (Hairer, Norsett, Wanner 1993)."""
from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

TOLERANCE = 1e-12
"""Relative and absolute error of each step."""

MAX_STEP = 5e-3
"""Maximum step, s: dense output is of order 7, whose error in long steps would be 1e-6."""


def integrate(derivative: Callable[[float, np.ndarray], np.ndarray], start: np.ndarray,
              times: Sequence[float]) -> np.ndarray:
    """Solve y' = derivative(t, y) from ``start`` at times[0]; values (t, n) at ``times`` s."""
    from scipy.integrate import solve_ivp
    solved = solve_ivp(derivative, (times[0], times[-1]), start, 'DOP853', times,
                       rtol=TOLERANCE, atol=TOLERANCE, max_step=MAX_STEP)
    if not solved.success:
        raise ArithmeticError(solved.message)
    return solved.y.T
