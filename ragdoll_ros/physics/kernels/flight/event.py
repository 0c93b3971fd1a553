"""The first instant at which a gap closes along a path: sought once, when the path is made."""
from __future__ import annotations

import math

import numpy as np

from ..collision.narrow_phase import collide
from ..collision.shapes import shape_at
from ..compiling.decorators import compiled
from ..contact.gaps import FAR, NEAR, TOUCHING, bone_velocity, ground_point, look
from ..system import Course, Room, System
from .path import STEADY, accelerations_of, along, point_velocity

MET = 1e-11
"""m or rad: the gap that is left at the instant of a touch."""

SAMPLES = 400
"""Looks at one path."""

LEAST_CHANGE = 1e-3
"""rad/s^2 that a joint's acceleration may reach, however small it is at a path's ends."""


@compiled
def time_to_close(gap: float, closing: float, acceleration: float) -> float:
    """Least time, s, in which a gap that closes at a speed may be gone."""
    if gap <= 0.0:
        return 0.0 if closing > 0 else -2 * closing / acceleration
    root = math.sqrt(closing * closing + 2 * acceleration * gap)
    return 2 * gap / (closing + root) if closing > 0 else (root - closing) / acceleration


@compiled
def due(gaps: np.ndarray, armed: np.ndarray, j: int) -> float:
    """Gap that is left until a touch: of what touches at the start, until it has sunk."""
    return gaps[j] if armed[j] > 0 else gaps[j] + 2 * TOUCHING


@compiled
def time_free(s: System, r: Room, q: np.ndarray, v: np.ndarray, gaps: np.ndarray,
              armed: np.ndarray, acceleration: float, relative: float, ends: np.ndarray) -> float:
    """Least time, s, until a gap may be gone; work is posed at q and v, geoms are placed.

    No point exceeds ``acceleration``, m/s^2, nor ``relative`` as seen by what falls freely, as both
    of a pair do. ``ends`` (2, nq + nv): rates at the path's ends, for those of the limited joints.
    """
    least, n, point = math.inf, 0, r.table[15]
    for k in range(len(s.geoms)):
        geom = s.geoms[k]
        if s.offset[0] > -math.inf:
            x, y, z, w = bone_velocity(r.work, geom.bone)
            falling = -(x * s.normal[0] + y * s.normal[1] + z * s.normal[2])
            for j in range(geom.count):
                gap, closing = due(gaps, armed, n + j), falling + w * geom.reach
                if gap < FAR:
                    ground_point(geom, j, r.at[k], r.turn[k], s.normal, point)
                    closing = -point_velocity(r.work, geom.bone, q, s.tree[s.root_of[geom.bone]].q,
                                              point, s.normal)
                least = min(least, time_to_close(gap, closing, acceleration))
        n += geom.count
    for k in range(len(s.bounds)):
        bound, at = s.bounds[k], len(q) + s.bounds[k].v
        rate = v[bound.v]
        change = STEADY * max(abs(ends[0, at]), abs(ends[1, at])) + LEAST_CHANGE
        if gaps[n] < math.inf:
            least = min(least, time_to_close(due(gaps, armed, n), -rate, change))
        if gaps[n + 1] < math.inf:
            least = min(least, time_to_close(due(gaps, armed, n + 1), rate, change))
        n += 2
    for k in range(len(s.pairs)):
        closing = pair_closing(s, r, q, k, gaps[n + k])
        least = min(least, time_to_close(due(gaps, armed, n + k), closing, 2 * relative))
    return least


@compiled
def pair_closing(s: System, r: Room, q: np.ndarray, k: int, gap: float) -> float:
    """Speed, m/s, at which a pair's gap closes, or a bound above it where they are far apart."""
    pair = s.pairs[k]
    a, b = s.geoms[pair.a], s.geoms[pair.b]
    if gap < NEAR:
        found = collide(shape_at(a, r.at[pair.a], r.turn[pair.a]),
                        shape_at(b, r.at[pair.b], r.turn[pair.b]), max(gap, 0.0) + 1e-4, r.manifold)
        if found:
            best = 0
            for j in range(1, found):
                if r.manifold[j].gap < r.manifold[best].gap:
                    best = j
            point, n = r.manifold[best].point, r.manifold[best].normal
            return (point_velocity(r.work, b.bone, q, s.tree[s.root_of[b.bone]].q, point, n)
                    - point_velocity(r.work, a.bone, q, s.tree[s.root_of[a.bone]].q, point, n))
    ax, ay, az, aw = bone_velocity(r.work, a.bone)
    bx, by, bz, bw = bone_velocity(r.work, b.bone)
    return (math.sqrt((ax - bx) ** 2 + (ay - by) ** 2 + (az - bz) ** 2) + aw * a.reach
            + bw * b.reach)


@compiled
def find_event(s: System, r: Room, course: Course) -> None:
    """Enter the instant of the path's first touch.

    By conservative advancement (Mirtich 1996): no gap is gone before its speed and the largest
    acceleration allow, and near a touch these steps converge as Newton's. Where a gap is found
    closed all the same, regula falsi goes back (Illinois: Dowell and Jarratt, BIT 11, 1971). What
    touches at the start counts from when it has come apart.
    """
    q, v, path, gaps, armed = r.states[1], r.vectors[0], course.path[0], r.later, r.armed
    length = path.length
    acceleration, relative = accelerations_of(s, r, course, q, v)
    for j in range(len(gaps)):
        armed[j] = 1.0 if r.gaps[j] > TOUCHING else 0.0
    time = before = 0.0
    for _ in range(SAMPLES):
        along(s.tree, course, time, q, v)
        look(s, r, q, v, gaps, math.inf, gaps)
        least = closest(gaps, armed)
        if least < -MET:
            path.event = go_back(s, r, course, before, time, q, v)
            return
        if least <= MET:
            path.event = time
            return
        step = time_free(s, r, q, v, gaps, armed, acceleration, relative, course.ends)
        before = time
        time += max(step, 1e-9)
        if time >= length:
            if before >= length:
                return
            time = length
    path.event = before
    r.tally[0].stalls += 1


@compiled
def closest(gaps: np.ndarray, armed: np.ndarray) -> float:
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
def go_back(s: System, r: Room, course: Course, early: float, late: float, q: np.ndarray,
            v: np.ndarray) -> float:
    """Instant, s, between two at which the least gap is gone."""
    above = below = 0.0
    time = early
    for turn in range(62):
        along(s.tree, course, time, q, v)
        look(s, r, q, v, r.later, math.inf, r.later)
        gap = closest(r.later, r.armed)
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
