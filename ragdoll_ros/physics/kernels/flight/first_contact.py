"""The first instant at which a gap closes along a path: sought once, when the path is made."""
from __future__ import annotations

import math

import numpy as np

from ..collision.pair import collide
from ..compiling.decorators import compiled
from ..contact.gaps import FAR, NEAR, TOUCHING, bone_velocity, ground_point, update_kinematics_and_gaps
from ..system import ClusterState, Workspace, System
from .dense_step import STEADY, acceleration_bounds, evaluate_dense_step, point_velocity

MET = 1e-11
"""m or rad: the gap that is left at the instant of a touch."""

SAMPLES = 400
"""Looks at one path."""

LEAST_CHANGE = 1e-3
"""rad/s^2 that a joint's acceleration may reach, however small it is at a path's ends."""


@compiled
def time_to_close_gap(gap: float, closing: float, acceleration: float) -> float:
    """Least time, s, in which a gap that closes at a speed may be gone."""
    if gap <= 0.0:
        return 0.0 if closing > 0 else -2 * closing / acceleration
    root = math.sqrt(closing * closing + 2 * acceleration * gap)
    return 2 * gap / (closing + root) if closing > 0 else (root - closing) / acceleration


@compiled
def gap_to_contact(gaps: np.ndarray, armed: np.ndarray, j: int) -> float:
    """Gap that is left until a touch: of what touches at the start, until it has sunk."""
    return gaps[j] if armed[j] > 0 else gaps[j] + 2 * TOUCHING


@compiled
def time_until_contact_possible(s: System, r: Workspace, q: np.ndarray, v: np.ndarray, gaps: np.ndarray,
              armed: np.ndarray, acceleration: float, relative: float, ends: np.ndarray) -> float:
    """Least time, s, until a gap may be gone; work is posed at q and v, geoms are placed.

    No point exceeds ``acceleration``, m/s^2, nor ``relative`` as seen by what falls freely, as both
    of a pair do. ``ends`` (2, nq + nv): rates at the path's ends, for those of the limited joints.
    """
    least, n, point = math.inf, 0, r.table[15]
    for k in range(len(s.geoms)):
        geom = s.geoms[k]
        if s.ground_offset[0] > -math.inf:
            x, y, z, w = bone_velocity(r.kinematics, geom.bone)
            falling = -(x * s.ground_normal[0] + y * s.ground_normal[1] + z * s.ground_normal[2])
            for j in range(geom.point_count):
                gap, closing = gap_to_contact(gaps, armed, n + j), falling + w * geom.reach
                if gap < FAR:
                    ground_point(geom, j, r.geom_positions[k], r.geom_rotations[k], s.ground_normal, point)
                    closing = -point_velocity(r.kinematics, geom.bone, q, s.tree[s.body_root[geom.bone]].q_start,
                                              point, s.ground_normal)
                least = min(least, time_to_close_gap(gap, closing, acceleration))
        n += geom.point_count
    for k in range(len(s.joint_limits)):
        bound, at = s.joint_limits[k], len(q) + s.joint_limits[k].v
        rate = v[bound.dof]
        change = STEADY * max(abs(ends[0, at]), abs(ends[1, at])) + LEAST_CHANGE
        if gaps[n] < math.inf:
            least = min(least, time_to_close_gap(gap_to_contact(gaps, armed, n), -rate, change))
        if gaps[n + 1] < math.inf:
            least = min(least, time_to_close_gap(gap_to_contact(gaps, armed, n + 1), rate, change))
        n += 2
    for k in range(len(s.pairs)):
        closing = pair_closing(s, r, q, k, gaps[n + k])
        least = min(least, time_to_close_gap(gap_to_contact(gaps, armed, n + k), closing, 2 * relative))
    return least


@compiled
def pair_closing(s: System, r: Workspace, q: np.ndarray, k: int, gap: float) -> float:
    """Speed, m/s, at which a pair's gap closes, or a bound above it where they are far apart."""
    pair = s.pairs[k]
    a, b = s.geoms[pair.a], s.geoms[pair.b]
    if gap < NEAR:
        found = collide(a.kind, a.size, r.geom_positions[pair.a], r.geom_rotations[pair.a], b.kind, b.size,
                        r.geom_positions[pair.b], r.geom_rotations[pair.b], max(gap, 0.0) + 1e-4, r.table)
        if found:
            best = 0
            for j in range(1, found):
                if r.table[j, 6] < r.table[best, 6]:
                    best = j
            point, n = r.table[best, :3], r.table[best, 3:6]
            return (point_velocity(r.kinematics, b.bone, q, s.tree[s.body_root[b.bone]].q_start, point, n)
                    - point_velocity(r.kinematics, a.bone, q, s.tree[s.body_root[a.bone]].q_start, point, n))
    ax, ay, az, aw = bone_velocity(r.kinematics, a.bone)
    bx, by, bz, bw = bone_velocity(r.kinematics, b.bone)
    return (math.sqrt((ax - bx) ** 2 + (ay - by) ** 2 + (az - bz) ** 2) + aw * a.reach
            + bw * b.reach)


@compiled
def find_first_contact(s: System, r: Workspace, course: ClusterState) -> None:
    """Enter the instant of the path's first touch.

    By conservative advancement (Mirtich 1996): no gap is gone before its speed and the largest
    acceleration allow, and near a touch these steps converge as Newton's. Where a gap is found
    closed all the same, regula falsi goes back (Illinois: Dowell and Jarratt, BIT 11, 1971). What
    touches at the start counts from when it has come apart.
    """
    q, v, path, gaps, armed = r.states[1], r.vectors[0], course.dense_step[0], r.gaps_end, r.armed
    length = path.length
    acceleration, relative = acceleration_bounds(s, r, course, q, v)
    for j in range(len(gaps)):
        armed[j] = 1.0 if r.gaps[j] > TOUCHING else 0.0
    time = before = 0.0
    for _ in range(SAMPLES):
        evaluate_dense_step(s.tree, course, time, q, v)
        update_kinematics_and_gaps(s, r, q, v, gaps, math.inf, gaps)
        least = least_gap(gaps, armed)
        if least < -MET:
            path.event_time = bisect_first_contact(s, r, course, before, time, q, v)
            return
        if least <= MET:
            path.event_time = time
            return
        step = time_until_contact_possible(s, r, q, v, gaps, armed, acceleration, relative, course.end_rates)
        before = time
        time += max(step, 1e-9)
        if time >= length:
            if before >= length:
                return
            time = length
    path.event_time = before
    r.stats[0].toi_failures += 1


@compiled
def least_gap(gaps: np.ndarray, armed: np.ndarray) -> float:
    """Least gap, m or rad, of those that count; what has come apart counts from now on."""
    least = math.inf
    for j in range(len(gaps)):
        if armed[j] > 0:
            least = min(least, gaps[j])
        elif gaps[j] > TOUCHING:
            armed[j] = 1.0
        else:
            least = min(least, gaps[j] + 2 * TOUCHING)
    return least


@compiled
def bisect_first_contact(s: System, r: Workspace, course: ClusterState, early: float, late: float, q: np.ndarray,
            v: np.ndarray) -> float:
    """Instant, s, between two at which the least gap is gone."""
    above = below = 0.0
    time = early
    for turn in range(62):
        evaluate_dense_step(s.tree, course, time, q, v)
        update_kinematics_and_gaps(s, r, q, v, r.gaps_end, math.inf, r.gaps_end)
        gap = least_gap(r.gaps_end, r.armed)
        if turn == 0:
            if gap <= 0:
                break
            above, time = gap, late
            continue
        if turn > 1 and (abs(gap) <= MET or late - early < 1e-13):
            break
        if gap > 0:
            early, above = time, gap
            below /= 2
        else:
            late, below = time, gap
            above = above / 2 if turn > 1 else above
        time = (early * below - late * above) / (below - above)
    return time
