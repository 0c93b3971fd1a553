"""A step of flight with dense output: Hairer's DOP853, of order 8, evaluated tick by tick."""
from __future__ import annotations

import math

import numpy as np

from ..cluster_state import ClusterState
from ..compiling.decorators import compiled
from ..dynamics.body import WORLD
from ..dynamics.forward_dynamics import state_derivative
from ..dynamics.kinematics import body_velocity, forward_kinematics, normalize
from ..maths.vectors import divide, dot, norm, put, sub, vec
from ..system import System
from ..workspace import Workspace
from .dop853 import CONTINUED, SLOWEST, STAGES, step_error, weighted_sum

SAFETY, MIN_GROWTH, MAX_GROWTH = 0.8, 0.2, 2.0
"""Share of the longest step that the tolerance allows, and bounds of a step over the last."""

MAX_ROUNDING = 1e-6
"""Error by rounding as a share of what the state changes: more is that of a step far too long."""

ROUNDING_MARGIN, ROUNDING_DECAY = 3.0, 0.9
"""Times the error by rounding found that a step may err; its share that the next step assumes."""

ROUNDED_GROWTH = 1.2
"""Growth of a step whose error is by rounding: to where the error of the method is as large."""

FIRST_ANGLE = 0.2
"""rad that the fastest body turns in the first step that is tried."""

MAX_TRIES = 30
"""Lengths of a step that are tried."""

ACCELERATION_FACTOR = 1.5
"""Times the mean acceleration over a step that accelerations within it may reach."""


@compiled
def dop853_step(s: System, ws: Workspace, cluster: ClusterState, h: float) -> float:
    """Compute a step of h s from cluster.q and v: write its polynomial to cluster.dense_output and
    the state derivatives at its ends to cluster.end_rates. The derivative at the start is taken
    from there if dense_step.first_rate_known. Returns step_error(), m or rad.
    """
    tree, flight = s.tree, ws.flight
    q, v, dense, rates, k, y = (cluster.q, cluster.v, cluster.dense_output, cluster.end_rates,
                                flight.stages, flight.derivative)
    nq, size = len(q), len(q) + len(v)
    start = dense[0]
    for j in range(nq):
        start[j] = q[j]
    for j in range(nq, size):
        start[j] = v[j - nq]
    normalize(tree, start[:nq])
    if cluster.dense_step[0].first_rate_known:
        for j in range(size):
            k[0, j] = rates[0, j]
    else:
        state_derivative(tree, s.gravity, cluster.loads, start[:nq], start[nq:], flight.kinematics,
                         ws.step.dynamics, k[0])
    for stage in range(1, 16):
        weighted_sum(STAGES[stage], stage, k, h, y)
        for j in range(size):
            y[j] += start[j]
        normalize(tree, y[:nq])
        if stage == 12:
            for j in range(size):
                dense[1, j] = y[j]
        state_derivative(tree, s.gravity, cluster.loads, y[:nq], y[nq:], flight.kinematics,
                         ws.step.dynamics, k[stage])
    for j in range(size):
        dense[1, j] -= start[j]
        dense[2, j] = h * k[0, j] - dense[1, j]
        dense[3, j] = 2 * dense[1, j] - h * (k[12, j] + k[0, j])
        rates[0, j], rates[1, j] = k[0, j], k[12, j]
    for row in range(4):
        weighted_sum(CONTINUED[row], 16, k, h, dense[4 + row])
    return step_error(k, h, nq, y)


@compiled
def evaluate_dense_step(tree: np.ndarray, cluster: ClusterState, time: float, q: np.ndarray,
                        v: np.ndarray) -> None:
    """Write coordinates and velocities ``time`` s after the step's start to q (nq,) and v (nv,)."""
    nq, dense = len(q), cluster.dense_output
    share = time / cluster.dense_step[0].length
    for j in range(nq + len(v)):
        y = 0.0
        for row in range(7, 0, -1):
            y = (y + dense[row, j]) * (share if row % 2 else 1 - share)
        y += dense[0, j]
        if j < nq:
            q[j] = y
        else:
            v[j - nq] = y
    normalize(tree, q)


@compiled
def begin_dense_step(s: System, ws: Workspace, cluster: ClusterState, tolerance: float,
                     longest: float) -> bool:
    """Make a dense step from cluster.q and v, as long as its error allows, at most ``longest`` s.
    Returns whether one was found whose error is at most ``tolerance``, m or rad, or at most the
    rounding error, if that is larger. Rounding errors over a given time are not reduced by shorter
    steps. They are large where a light root has a heavy tip: as many digits are lost as the ratio
    of their masses has.
    """
    step = cluster.dense_step[0]
    if step.next_length <= 0:
        step.next_length = first_length(s, ws, cluster)
    h, before = min(longest, step.next_length), math.inf
    tried = h
    step.rounding *= ROUNDING_DECAY
    for _ in range(MAX_TRIES):
        error, share = dop853_step(s, ws, cluster, h), h / tried
        ws.stats[0].flight_steps += 1
        # The method's error falls with order 8, that of rounding with 1.
        if tolerance < error < math.inf and error > before * share * share * share and (
                error < MAX_ROUNDING * h * largest_rate(cluster)):
            step.rounding = max(step.rounding, ROUNDING_MARGIN * error / h)
        ratio = error / max(tolerance, step.rounding * h)
        growth = SAFETY / math.sqrt(math.sqrt(math.sqrt(ratio))) if ratio > 0 else MAX_GROWTH
        if ratio <= 1 and error > tolerance:
            growth = ROUNDED_GROWTH if ratio < 0.5 else 1.0
        step.length, step.error = h, error
        step.next_length = h * min(MAX_GROWTH, max(MIN_GROWTH, growth))
        if ratio <= 1:
            step.valid, step.elapsed, step.event_time = 1, 0.0, math.inf
            return True
        before, tried = error, h
        h = min(h * MIN_GROWTH if error == math.inf else step.next_length, longest)
        step.first_rate_known = 1 if math.isfinite(cluster.end_rates[0, 0]) else 0
    step.valid = 0
    return False


@compiled
def largest_rate(cluster: ClusterState) -> float:
    """Largest component of dq/dt, and of dv/dt times SLOWEST, at both ends of a step: the weights
    of step_error().
    """
    most = 0.0
    for end in range(2):
        for j in range(cluster.end_rates.shape[1]):
            weight = 1.0 if j < len(cluster.q) else SLOWEST
            most = max(most, abs(cluster.end_rates[end, j]) * weight)
    return most


@compiled
def first_length(s: System, ws: Workspace, cluster: ClusterState) -> float:
    """Length, s, of the first step that is tried: in it the fastest body turns by FIRST_ANGLE.
    Overwrites ws.flight.kinematics.
    """
    kin, fast = ws.flight.kinematics, 1e-9
    forward_kinematics(s.tree, cluster.q, cluster.v, kin)
    for i in range(len(s.tree)):
        turn = vec(kin.spatial_velocities[i])
        fast = max(fast, dot(turn, turn))
    return FIRST_ANGLE / math.sqrt(fast)


@compiled
def acceleration_bounds(s: System, ws: Workspace, cluster: ClusterState) -> tuple[float, float]:
    """Bounds, m/s^2, on the acceleration of all points in the step, and on that relative to free
    fall, estimated from the velocities at its ends. Overwrites ws.flight.
    """
    flight, h, motion = ws.flight, cluster.dense_step[0].length, ws.flight.motion
    kin, gravity = flight.kinematics, vec(s.gravity)
    evaluate_dense_step(s.tree, cluster, 0.0, flight.q, flight.v)
    forward_kinematics(s.tree, flight.q, flight.v, kin)
    for i in range(len(s.tree)):
        velocity, motion[i].angular_speed = body_velocity(kin, i)
        put(motion[i].velocity, velocity)
        motion[i].reach = 0.0
    evaluate_dense_step(s.tree, cluster, h, flight.q, flight.v)
    forward_kinematics(s.tree, flight.q, flight.v, kin)
    for k in range(len(s.geoms)):
        i = s.geoms[k].body
        if i != WORLD:
            motion[i].reach = max(motion[i].reach, s.geoms[k].reach)
    most = falling = 0.0
    for i in range(len(s.tree)):
        velocity, w = body_velocity(kin, i)
        own, reach = motion[i], motion[i].reach
        change = divide(sub(velocity, vec(own.velocity)), h)
        turning = (abs(w - own.angular_speed) / h * reach
                   + 2 * max(w, own.angular_speed) ** 2 * reach)
        most = max(most, norm(change) + turning)
        falling = max(falling, norm(sub(change, gravity)) + turning)
    g = norm(gravity)
    return ACCELERATION_FACTOR * (most + g) + 1e-3, ACCELERATION_FACTOR * falling + 1e-3
