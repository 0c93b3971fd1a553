"""Time of impact in flight: the first contact along a step, sought once, when the step is made."""
from __future__ import annotations

import math

import numpy as np

from ..cluster_state import ClusterState
from ..collision.narrow_phase import collide
from ..collision.shapes import PLANE
from ..compiling.decorators import compiled
from ..contact.gaps import (FAR, NEAR, clear_corrections, ground_point, plane_of,
                            update_kinematics_and_gaps)
from ..contact.jacobian import normal_velocity
from ..contact.placed_shape import placed_shape
from ..dynamics.body import WORLD
from ..dynamics.kinematics import Kinematics, body_velocity
from ..maths.vectors import dot, norm, sub, vec
from ..system import System
from ..workspace import Workspace
from .dense_step import ACCELERATION_FACTOR, acceleration_bounds, evaluate_dense_step

CLOSED = 1e-11
"""m or rad: the gap that is left at the time of a contact."""

TOUCHING = 1e-6
"""m or rad: what is farther has separated."""

DEEPEST_START = -10 * TOUCHING
"""m or rad: least gap with which a flight may begin; deeper ones are corrected by contact steps."""

MAX_SAMPLES = 400
"""Instants of one step at which gaps are computed."""

MAX_ITERATIONS = 62
"""Iterations of regula falsi."""

LEAST_CHANGE = 1e-3
"""rad/s^2 that a joint's acceleration may reach, however small it is at the ends of a step."""


@compiled
def time_to_close(gap: float, closing: float, acceleration: float) -> float:
    """Least time, s, for a gap that closes at a speed to close, by a bound on acceleration. Of a
    gap of 0 or less: 0 if it closes, else until it is back at its value.
    """
    if gap <= 0.0:
        return 0.0 if closing > 0 else -2 * closing / acceleration
    root = math.sqrt(closing * closing + 2 * acceleration * gap)
    return 2 * gap / (closing + root) if closing > 0 else (root - closing) / acceleration


@compiled
def time_without_contact(s: System, ws: Workspace, kin: Kinematics, q: np.ndarray, v: np.ndarray,
                         gaps: np.ndarray, acceleration: float,
                         acceleration_in_free_fall: float, end_rates: np.ndarray) -> float:
    """Return a lower bound, s, of the time until a gap falls to its entry in flight.contact_gaps.
    ``kin``: of q and v, with its geoms. Bounds, m/s^2: ``acceleration``, for points against the
    ground or static geoms; ``acceleration_in_free_fall``, relative to free fall, for each of two
    bodies that move. ``end_rates`` (2, nq + nv): state derivatives at the ends of the step, for the
    limited joints. Overwrites contacts.manifold.
    """
    least, n, contact = math.inf, 0, ws.flight.contact_gaps
    for k in range(len(s.geoms)):
        geom = s.geoms[k]
        if geom.point_count and s.ground_offset[0] > -math.inf:
            normal = vec(s.ground_normal)
            velocity, w = body_velocity(kin, geom.body)
            falling = -dot(velocity, normal)
            for j in range(geom.point_count):
                gap, closing = gaps[n + j] - contact[n + j], falling + w * geom.reach
                if gap < FAR:
                    point = ground_point(s, geom, j, kin.geom_positions[k], kin.geom_rotations[k],
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
            least = min(least, time_to_close(gaps[n] - contact[n], -rate, change))
        if gaps[n + 1] < math.inf:
            least = min(least, time_to_close(gaps[n + 1] - contact[n + 1], rate, change))
        n += 2
    for k in range(len(s.pairs)):
        bound = (acceleration if s.geoms[s.pairs[k].b].body == WORLD
                 else 2 * acceleration_in_free_fall)
        least = min(least, pair_time_to_close(s, ws, kin, q, k, gaps[n + k], contact[n + k], bound))
    return least


@compiled
def pair_time_to_close(s: System, ws: Workspace, kin: Kinematics, q: np.ndarray, k: int, gap: float,
                       contact: float, acceleration: float) -> float:
    """Least time, s, in which the ``gap`` of pair k, m, can fall to ``contact``, m; of a near pair,
    by all points of its manifold, as another than the nearest may close first. ``acceleration``,
    m/s^2: bound on the relative one. Overwrites contacts.manifold.
    """
    pair, manifold = s.pairs[k], ws.contacts.manifold
    a, b = s.geoms[pair.a], s.geoms[pair.b]
    if b.kind == PLANE and gap < FAR:
        normal, _ = plane_of(kin, pair.b)
        point = ground_point(s, a, pair.point, kin.geom_positions[pair.a],
                             kin.geom_rotations[pair.a], normal)
        closing = -normal_velocity(s, kin, q, a.body, point, normal)
        return time_to_close(gap - contact, closing, acceleration)
    if b.kind != PLANE and gap < NEAR:
        found = collide(placed_shape(s, kin, pair.a), placed_shape(s, kin, pair.b), NEAR, manifold)
        least = math.inf
        for j in range(found):
            point, normal = vec(manifold[j].point), vec(manifold[j].normal)
            closing = (normal_velocity(s, kin, q, b.body, point, normal)
                       - normal_velocity(s, kin, q, a.body, point, normal))
            least = min(least, time_to_close(manifold[j].gap - contact, closing, acceleration))
        if found:
            return least
    one, turn_a = body_velocity(kin, a.body)
    closing = norm(one) + turn_a * a.reach
    if b.body != WORLD:
        other, turn_b = body_velocity(kin, b.body)
        closing = norm(sub(one, other)) + turn_a * a.reach + turn_b * b.reach
    return time_to_close(gap - contact, closing, acceleration)


@compiled
def find_first_contact(s: System, ws: Workspace, cluster: ClusterState) -> None:
    """Find the time of the first contact along the dense step and write it to
    dense_step.event_time, s; if there is none, event_time stays infinite.

    By conservative advancement (Mirtich 1996): each advance is the time in which no gap can close,
    by its speed and a bound on accelerations. Near a contact these advances converge like Newton's
    method. If a gap is found closed, regula falsi searches the last advance (Illinois: Dowell and
    Jarratt, BIT 11, 1971). What touches at the start counts once it has separated or penetrates
    deeper, see set_contact_gaps(). After MAX_SAMPLES instants the last one becomes event_time, and
    stats.toi_failures is incremented.
    """
    flight, step, gaps = ws.flight, cluster.dense_step[0], ws.contacts.gaps_end
    q, v, kin = flight.q, flight.v, flight.kinematics
    acceleration, relative = acceleration_bounds(s, ws, cluster)
    set_contact_gaps(ws)
    clear_corrections(ws.contacts.motion)
    time = before = 0.0
    for k in range(MAX_SAMPLES):
        evaluate_dense_step(s.tree, cluster, time, q, v)
        gone = time - before if k else math.inf
        if k:
            lower_pair_gaps(s, ws, gaps, 2 * acceleration * gone * gone)
        update_kinematics_and_gaps(s, ws, kin, q, v, gaps, gone, gaps)
        least = least_gap(ws, gaps)
        if least < -CLOSED:
            step.event_time = refine_contact_time(s, ws, cluster, before, time)
            return
        if least <= CLOSED:
            step.event_time = time
            return
        reset_separated(ws, gaps)
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
def lower_pair_gaps(s: System, ws: Workspace, gaps: np.ndarray, distance: float) -> None:
    """Subtract ``distance``, m, from the gaps of pairs: accelerations may have closed them by as
    much, and update_gaps() bounds the motion by speeds alone.
    """
    fixed = ws.gap_counts[0].fixed
    for j in range(fixed - len(s.pairs), fixed):
        gaps[j] -= distance


@compiled
def set_contact_gaps(ws: Workspace) -> None:
    """Write flight.contact_gaps, m or rad, the gaps at which contacts count: 0 for a gap above
    TOUCHING, else the smaller of -2 TOUCHING and the present gap less TOUCHING, but at least
    DEEPEST_START: what penetrates farther does not fly. So what touches must first penetrate
    deeper: else an existing penetration would be a contact at once, and again after each impact.
    """
    for j in range(ws.gap_counts[0].fixed):
        ws.flight.contact_gaps[j] = 0.0 if ws.gaps[j] > TOUCHING else max(
            min(ws.gaps[j] + TOUCHING, 0.0) - 2 * TOUCHING, DEEPEST_START)


@compiled
def least_gap(ws: Workspace, gaps: np.ndarray) -> float:
    """What is left, m or rad, until the first of the gaps is a contact."""
    least = math.inf
    for j in range(ws.gap_counts[0].fixed):
        least = min(least, gaps[j] - ws.flight.contact_gaps[j])
    return least


@compiled
def reset_separated(ws: Workspace, gaps: np.ndarray) -> None:
    """Set contact_gaps of all gaps above TOUCHING to 0, so that these count as contacts when they
    close again. refine_contact_time() must not search before this instant.
    """
    for j in range(ws.gap_counts[0].fixed):
        if gaps[j] > TOUCHING:
            ws.flight.contact_gaps[j] = 0.0


@compiled
def refine_contact_time(s: System, ws: Workspace, cluster: ClusterState, early: float,
                        late: float) -> float:
    """Find the time, s, between ``early`` and ``late`` at which the first gap closes, by regula
    falsi: least_gap() is within CLOSED of 0, or the bracket is shorter than 1e-13 s. Returns
    ``early`` if least_gap() is not positive there. Overwrites q, v and kinematics of ws.flight and
    contacts.gaps_end.
    """
    flight, gaps = ws.flight, ws.contacts.gaps_end
    above = below = 0.0
    time = early
    for turn in range(MAX_ITERATIONS):
        evaluate_dense_step(s.tree, cluster, time, flight.q, flight.v)
        update_kinematics_and_gaps(s, ws, flight.kinematics, flight.q, flight.v, gaps, math.inf,
                                   gaps)
        gap = least_gap(ws, gaps)
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
