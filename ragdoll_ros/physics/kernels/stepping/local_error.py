"""Steps longer than the nominal one, of what moves slowly and smoothly, as a doll that lies still.

Their length follows from the local error of the midpoint rule, h^3 / 12 d^2v/dt^2 in the
coordinates after a step of h s (Hairer, Lubich, Wanner, Geometric Numerical Integration, 2006,
II.1), and from their speed.
"""
from __future__ import annotations

import math

import numpy as np

from ..cluster_state import ClusterState
from ..compiling.decorators import compiled

QUIET = 0.5
"""m/s^2 or rad/s^2: the local error of a longer step is at most that of a nominal one in which the
acceleration changes by so much; so it is of second order in that. What tumbles changes its
acceleration by 10 to 100 in a step."""

SLOW_MOTION = 0.1
"""m/s or rad/s: in a longer step nothing moves farther than at this speed in a nominal one. What
slides fast keeps nominal steps: friction acts along the slip at a step's end, which is of first
order in its length."""

LONGEST_STEP = 0.02
"""s: the longest contact step."""

SAFETY = 0.7
"""Share of the allowed error that a step of twice the length is expected to have."""

ROUNDING = 1e-6
"""Share of the nominal step by which the equal parts of a tick may be longer by rounding."""


@compiled
def local_error(cluster: ClusterState, v_end: np.ndarray, h: float) -> float:
    """Estimate the error, m or rad, of the coordinates after the step of h s just taken, from the
    change of the mean acceleration since the step before; infinite if that acceleration is
    unknown.
    """
    before, change = cluster.stats[0].acceleration_dt, 0.0
    if before == 0:
        return math.inf
    for j in range(len(v_end)):
        change = max(change, abs((v_end[j] - cluster.v[j]) / h - cluster.accelerations[j]))
    return h * h * h / 12 * change / ((h + before) / 2)


@compiled
def allowed_error(nominal: float) -> float:
    """Largest local error, m or rad, allowed in a step longer than ``nominal`` s: that of a nominal
    step in which the acceleration changes by QUIET.
    """
    return nominal * nominal / 12 * QUIET


@compiled
def is_longer(h: float, nominal: float) -> bool:
    """Whether a step of h s is longer than ``nominal`` s, but for rounding."""
    return h > (1 + ROUNDING) * nominal


@compiled
def is_too_long(cluster: ClusterState, v_end: np.ndarray, h: float, nominal: float) -> bool:
    """Whether the step of h s just taken is longer than ``nominal`` s and its error too large."""
    return is_longer(h, nominal) and not (
        local_error(cluster, v_end, h) <= allowed_error(nominal))


@compiled
def set_smooth_dt(cluster: ClusterState, v_end: np.ndarray, h: float, nominal: float) -> None:
    """Write stats.smooth_dt, s: the length above ``nominal`` that error and speed of the step of h
    s just taken allow the next one, else 0. Store the mean accelerations of the step in the
    cluster.
    """
    stats, error, allowed = cluster.stats[0], local_error(cluster, v_end, h), allowed_error(nominal)
    longer, speed = 0.0, 0.0
    if error <= allowed:
        longer = max(h, stats.smooth_dt)
    if 8 * error <= SAFETY * allowed:
        longer = max(2 * h, longer)
    for j in range(len(v_end)):
        speed = max(speed, abs(v_end[j]))
    longer = min(longer, LONGEST_STEP)
    if longer * speed > nominal * SLOW_MOTION:
        longer = nominal * SLOW_MOTION / speed
    stats.smooth_dt = longer if is_longer(longer, nominal) else 0.0
    for j in range(len(v_end)):
        cluster.accelerations[j] = (v_end[j] - cluster.v[j]) / h
    stats.acceleration_dt = h


@compiled
def forget_accelerations(cluster: ClusterState) -> None:
    """Mark the last accelerations as unknown, after an impact or a flight: set
    stats.acceleration_dt and stats.smooth_dt to 0.
    """
    cluster.stats[0].acceleration_dt = cluster.stats[0].smooth_dt = 0.0
