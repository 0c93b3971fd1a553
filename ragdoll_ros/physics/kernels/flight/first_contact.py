"""Time of impact in flight: the first contact along a step, sought once, when the step is made."""
from __future__ import annotations

import math

import numpy as np

from ..cluster_state import ClusterState
from ..collision.narrow_phase import collide
from ..compiling.decorators import compiled
from ..contact.gaps import (FAR, NEAR, TOUCHING, ground_point, placed_shape,
                            update_kinematics_and_gaps)
from ..contact.jacobian import root_of
from ..dynamics.kinematics import Kinematics, body_velocity, velocity_at
from ..maths.vectors import Vec3, dot, norm, sub, vec
from ..system import System
from ..workspace import Workspace
from .dense_step import ACCELERATION_FACTOR, acceleration_bounds, evaluate_dense_step

CLOSED = 1e-11
"""m or rad: the gap that is left at the time of a contact."""

MAX_SAMPLES = 400
"""Instants of one step at which gaps are computed."""

MAX_ITERATIONS = 62
"""Iterations of regula falsi."""

LEAST_CHANGE = 1e-3
"""rad/s^2 that a joint's acceleration may reach, however small it is at the ends of a step."""


@compiled
def time_to_close(gap: float, closing: float, acceleration: float) -> float:
    """Least time, s, for a gap that closes at a speed to close, by a bound on acceleration."""
    if gap <= 0.0:
        return 0.0 if closing > 0 else -2 * closing / acceleration
    root = math.sqrt(closing * closing + 2 * acceleration * gap)
    return 2 * gap / (closing + root) if closing > 0 else (root - closing) / acceleration


@compiled
def gap_to_contact(gaps: np.ndarray, armed: np.ndarray, j: int) -> float:
    """Gap j left until contact: unarmed, it touched at the start and must penetrate first."""
    return gaps[j] if armed[j] > 0 else gaps[j] + 2 * TOUCHING


@compiled
def time_without_contact(s: System, ws: Workspace, kin: Kinematics, q: np.ndarray, v: np.ndarray,
                         gaps: np.ndarray, acceleration: float,
                         acceleration_in_free_fall: float, end_rates: np.ndarray) -> float:
    """Least time, s, until a gap may close; ``kin`` is that of q and v, with its geoms. Reads
    flight.armed, overwrites contacts.manifold. No point exceeds ``acceleration``, m/s^2, nor
    ``acceleration_in_free_fall``, relative to free fall, which a pair counts twice. ``end_rates``
    (2, nq + nv): state derivatives at the ends of the step, for those of the limited joints.
    """
    least, n, armed = math.inf, 0, ws.flight.armed
    for k in range(len(s.geoms)):
        geom = s.geoms[k]
        if s.ground_offset[0] > -math.inf:
            normal = vec(s.ground_normal)
            velocity, w = body_velocity(kin, geom.body)
            falling = -dot(velocity, normal)
            for j in range(geom.point_count):
                gap, closing = gap_to_contact(gaps, armed, n + j), falling + w * geom.reach
                if gap < FAR:
                    point = ground_point(geom, j, kin.geom_positions[k], kin.geom_rotations[k],
                                         normal)
                    closing = -normal_velocity(s, kin, q, geom.body, point, normal)
                least = min(least, time_to_close(gap, closing, acceleration))
        n += geom.point_count
    for k in range(len(s.joint_limits)):
        dof = s.joint_limits[k].dof
        rate, at = v[dof], len(q) + dof
        change = (ACCELERATION_FACTOR * max(abs(end_rates[0, at]), abs(end_rates[1, at]))
                  + LEAST_CHANGE)
        if gaps[n] < math.inf:
            least = min(least, time_to_close(gap_to_contact(gaps, armed, n), -rate, change))
        if gaps[n + 1] < math.inf:
            least = min(least, time_to_close(gap_to_contact(gaps, armed, n + 1), rate, change))
        n += 2
    for k in range(len(s.pairs)):
        closing = pair_closing_speed(s, ws, kin, q, k, gaps[n + k])
        least = min(least, time_to_close(gap_to_contact(gaps, armed, n + k), closing,
                                         2 * acceleration_in_free_fall))
    return least


@compiled
def normal_velocity(s: System, kin: Kinematics, q: np.ndarray, body: int, point: Vec3,
                    normal: Vec3) -> float:
    """Velocity, m/s, along ``normal`` of a body's point that is at ``point``, m, world."""
    return dot(normal, velocity_at(kin, body, sub(point, root_of(s, q, body))))


@compiled
def pair_closing_speed(s: System, ws: Workspace, kin: Kinematics, q: np.ndarray, k: int,
                       gap: float) -> float:
    """Speed, m/s, at which the gap of pair k closes, or an upper bound where it is far."""
    pair, manifold = s.pairs[k], ws.contacts.manifold
    a, b = s.geoms[pair.a], s.geoms[pair.b]
    if gap < NEAR:
        found = collide(placed_shape(s, kin, pair.a), placed_shape(s, kin, pair.b),
                        max(gap, 0.0) + 1e-4, manifold)
        if found:
            best = 0
            for j in range(1, found):
                if manifold[j].gap < manifold[best].gap:
                    best = j
            point, normal = vec(manifold[best].point), vec(manifold[best].normal)
            return (normal_velocity(s, kin, q, b.body, point, normal)
                    - normal_velocity(s, kin, q, a.body, point, normal))
    one, turn_a = body_velocity(kin, a.body)
    other, turn_b = body_velocity(kin, b.body)
    return norm(sub(one, other)) + turn_a * a.reach + turn_b * b.reach


@compiled
def find_first_contact(s: System, ws: Workspace, cluster: ClusterState) -> None:
    """Write the time of the first contact along the step to dense_step.event_time, s; if there is
    none, it stays infinite.

    By conservative advancement (Mirtich 1996): no gap closes before its speed and the largest
    acceleration allow, and near a contact these steps converge as Newton's. Where a gap is found
    closed all the same, regula falsi goes back (Illinois: Dowell and Jarratt, BIT 11, 1971). What
    touches at the start counts from when it has separated.
    """
    flight, step, gaps = ws.flight, cluster.dense_step[0], ws.contacts.gaps_end
    q, v, kin = flight.q, flight.v, flight.kinematics
    acceleration, relative = acceleration_bounds(s, ws, cluster)
    arm_gaps(ws)
    time = before = 0.0
    for _ in range(MAX_SAMPLES):
        evaluate_dense_step(s.tree, cluster, time, q, v)
        update_kinematics_and_gaps(s, ws, kin, q, v, gaps, math.inf, gaps)
        least = least_gap(gaps, flight.armed)
        if least < -CLOSED:
            step.event_time = regula_falsi(s, ws, cluster, before, time)
            return
        if least <= CLOSED:
            step.event_time = time
            return
        arm_separated(gaps, flight.armed)
        safe = time_without_contact(s, ws, kin, q, v, gaps, acceleration, relative,
                                    cluster.end_rates)
        before = time
        time += max(safe, 1e-9)
        if time >= step.length:
            if before >= step.length:
                return
            time = step.length
    step.event_time = before
    ws.stats[0].toi_failures += 1


@compiled
def arm_gaps(ws: Workspace) -> None:
    """Write flight.armed: 1 for gaps that do not touch, whose closing is a contact, else 0."""
    for j in range(len(ws.gaps)):
        ws.flight.armed[j] = 1.0 if ws.gaps[j] > TOUCHING else 0.0


@compiled
def least_gap(gaps: np.ndarray, armed: np.ndarray) -> float:
    """Least gap, m or rad, by gap_to_contact()."""
    least = math.inf
    for j in range(len(gaps)):
        least = min(least, gap_to_contact(gaps, armed, j))
    return least


@compiled
def arm_separated(gaps: np.ndarray, armed: np.ndarray) -> None:
    """Arm gaps that have separated, at an instant before which regula_falsi() will not look."""
    for j in range(len(gaps)):
        if gaps[j] > TOUCHING:
            armed[j] = 1.0


@compiled
def regula_falsi(s: System, ws: Workspace, cluster: ClusterState, early: float,
                 late: float) -> float:
    """Time, s, between ``early`` and ``late`` at which the least gap closes."""
    flight, gaps = ws.flight, ws.contacts.gaps_end
    above = below = 0.0
    time = early
    for turn in range(MAX_ITERATIONS):
        evaluate_dense_step(s.tree, cluster, time, flight.q, flight.v)
        update_kinematics_and_gaps(s, ws, flight.kinematics, flight.q, flight.v, gaps, math.inf,
                                   gaps)
        gap = least_gap(gaps, flight.armed)
        if turn == 0:
            if gap <= 0:
                break
            above, time = gap, late
            continue
        if turn > 1 and (abs(gap) <= CLOSED or late - early < 1e-13):
            break
        if gap > 0:
            early, above = time, gap
            below /= 2
        else:
            late, below = time, gap
            above = above / 2 if turn > 1 else above
        time = (early * below - late * above) / (below - above)
    return time
