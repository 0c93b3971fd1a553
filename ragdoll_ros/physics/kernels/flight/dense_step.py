"""A path through the air: a step of order 8 with its error, and where all is along it.

It is one step of Hairer's DOP853 with its dense output, gone tick by tick.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..contact.gaps import bone_velocity
from ..dynamics.forward_dynamics import Kinematics, normalize, forward_kinematics, state_derivative
from ..maths.quaternion import cross
from ..system import ClusterState, Workspace, System
from .dop853 import CONTINUED, STAGES, add_up, step_error

SAFETY, SHORTER, LONGER = 0.8, 0.2, 2.0
"""Share of the longest step that the tolerance allows, and bounds of a step over the last."""

HELPED = 0.5
"""Share of a step's error that a shorter one must come below; else what is left is rounding."""

FIRST_TURN = 0.2
"""rad that the fastest bone turns in the first step that is tried."""

STEADY = 1.5
"""Times the change of velocities along a path, over its length, that accelerations may reach."""


@compiled
def dop853_step(s: System, r: Workspace, loads: np.ndarray, course: ClusterState, h: float) -> float:
    """Enter the step of h s from where all is as the course's path; its error."""
    tree, gravity, work, k, y = s.tree, s.gravity, r.kinematics, r.stages, r.row
    q, v, dense, ends = course.q, course.v, course.dense_output, course.end_rates
    nq, size = len(q), len(q) + len(v)
    start = dense[0]
    for j in range(nq):
        start[j] = q[j]
    for j in range(nq, size):
        start[j] = v[j - nq]
    normalize(tree, start[:nq])
    if course.dense_step[0].first_rate_known:
        for j in range(size):
            k[0, j] = ends[0, j]
    else:
        state_derivative(tree, gravity, loads, start[:nq], start[nq:], work, k[0])
    for stage in range(1, 16):
        add_up(STAGES[stage], stage, k, h, y)
        for j in range(size):
            y[j] += start[j]
        normalize(tree, y[:nq])
        if stage == 12:
            for j in range(size):
                dense[1, j] = y[j]
        state_derivative(tree, gravity, loads, y[:nq], y[nq:], work, k[stage])
    for j in range(size):
        dense[1, j] -= start[j]
        dense[2, j] = h * k[0, j] - dense[1, j]
        dense[3, j] = 2 * dense[1, j] - h * (k[12, j] + k[0, j])
        ends[0, j], ends[1, j] = k[0, j], k[12, j]
    for row in range(4):
        add_up(CONTINUED[row], 16, k, h, dense[4 + row])
    return step_error(k, h, nq, y)


@compiled
def evaluate_dense_step(tree: np.ndarray, course: ClusterState, time: float, q: np.ndarray, v: np.ndarray) -> None:
    """Coordinates and velocities at an instant of the path, s from its start."""
    nq, dense = len(q), course.dense_output
    share = time / course.dense_step[0].length
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
def begin_dense_step(s: System, r: Workspace, course: ClusterState, loads: np.ndarray, tolerance: float,
               longest: float) -> bool:
    """Make a path from where all is, as long as its error allows, at most ``longest`` s. False:
    none was found that errs little enough.
    """
    path = course.dense_step[0]
    forward_kinematics(s.tree, course.q, course.v, r.kinematics)
    if path.next_length <= 0:
        fast = 1e-9
        for i in range(len(s.tree)):
            move = r.kinematics.spatial_velocities[i]
            fast = max(fast, move[0] ** 2 + move[1] ** 2 + move[2] ** 2)
        path.next_length = FIRST_TURN / math.sqrt(fast)
    h, before = min(longest, path.next_length), math.inf
    for _ in range(30):
        error = dop853_step(s, r, loads, course, h)
        r.stats[0].flight_steps += 1
        ratio = error / tolerance
        factor = SAFETY / math.sqrt(math.sqrt(math.sqrt(ratio))) if ratio > 0 else LONGER
        good = ratio <= 1 or (HELPED * before < error < math.inf)
        path.length, path.error = h, error
        path.next_length = h * min(LONGER, max(SHORTER, factor))
        if good:
            path.valid, path.elapsed, path.event_time = 1, 0.0, math.inf
            return True
        before, h = error, min(h * SHORTER if error == math.inf else path.next_length, longest)
        path.first_rate_known = 1 if math.isfinite(course.end_rates[0, 0]) else 0
    path.valid = 0
    return False


@compiled
def point_velocity(work: Kinematics, i: int, q: np.ndarray, root: int, point: np.ndarray,
                   n: np.ndarray) -> float:
    """Velocity of a bone's point (3,) m in the world along n; ``root``: where in q its doll's root
    stands. Work is posed.
    """
    m = work.spatial_velocities[i]
    x, y, z = cross(m[0], m[1], m[2], point[0] - q[root], point[1] - q[root + 1],
                    point[2] - q[root + 2])
    return n[0] * (m[3] + x) + n[1] * (m[4] + y) + n[2] * (m[5] + z)


@compiled
def acceleration_bounds(s: System, r: Workspace, course: ClusterState, q: np.ndarray,
                     v: np.ndarray) -> tuple[float, float]:
    """Acceleration, m/s^2, that no point exceeds on the path, and that none exceeds as seen by what
    falls freely, as its ends tell; q, v: room.
    """
    bones, h = len(s.tree), course.dense_step[0].length
    evaluate_dense_step(s.tree, course, 0.0, q, v)
    forward_kinematics(s.tree, q, v, r.kinematics)
    for i in range(bones):
        x, y, z, w = bone_velocity(r.kinematics, i)
        r.own[i, 0], r.own[i, 1], r.own[i, 2], r.own[i, 3] = x, y, z, w
        r.own[i, 4] = 0.0
    evaluate_dense_step(s.tree, course, h, q, v)
    forward_kinematics(s.tree, q, v, r.kinematics)
    for k in range(len(s.geoms)):
        i = s.geoms[k].bone
        r.own[i, 4] = max(r.own[i, 4], s.geoms[k].reach)
    most = falling = 0.0
    gx, gy, gz = s.gravity[0], s.gravity[1], s.gravity[2]
    for i in range(bones):
        x, y, z, w = bone_velocity(r.kinematics, i)
        own, reach = r.own[i], r.own[i, 4]
        x, y, z = (x - own[0]) / h, (y - own[1]) / h, (z - own[2]) / h
        turning = abs(w - own[3]) / h * reach + 2 * max(w, own[3]) ** 2 * reach
        most = max(most, math.sqrt(x * x + y * y + z * z) + turning)
        falling = max(falling, math.sqrt((x - gx) ** 2 + (y - gy) ** 2 + (z - gz) ** 2) + turning)
    g = math.sqrt(gx * gx + gy * gy + gz * gz)
    return STEADY * (most + g) + 1e-3, STEADY * falling + 1e-3
