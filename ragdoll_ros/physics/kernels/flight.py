"""Flight: where nothing touches, steps of order 8 up to the located instant of the next touch.

A path is one step of Hairer's DOP853 with its dense output; it is gone tick by tick, and searched
once, when it is made, for the first instant at which a gap closes.
"""
from __future__ import annotations

import math

import numpy as np

from .collision import collide
from .contact import FAR, NEAR, TOUCHING, bone_velocity, ground_point, look
from .dop853 import CONTINUED, STAGES, add_up, step_error
from .dynamics import Work, normalize, pose, rates
from .machine import compiled
from .quaternion import cross
from .system import Course, Room, System

SAFETY, SHORTER, LONGER = 0.8, 0.2, 2.0
"""Share of the longest step that the tolerance allows, and bounds of a step over the last."""

HELPED = 0.5
"""Share of a step's error that a shorter one must come below; else what is left is rounding."""

FIRST_TURN = 0.2
"""rad that the fastest bone turns in the first step that is tried."""

MET = 1e-11
"""m or rad: the gap that is left at the instant of a touch."""

SAMPLES = 400
"""Looks at one path."""

LEAST_CHANGE = 1e-3
"""rad/s^2 that a joint's acceleration may reach, however small it is at a path's ends."""

STEADY = 1.5
"""Times the change of velocities along a path, over its length, that accelerations may reach."""


@compiled
def path_step(s: System, r: Room, loads: np.ndarray, course: Course, h: float) -> float:
    """Enter the step of h s from where all is as the course's path; its error."""
    tree, gravity, work, k, y = s.tree, s.gravity, r.work, r.stages, r.row
    q, v, dense, ends = course.q, course.v, course.dense, course.ends
    nq, size = len(q), len(q) + len(v)
    start = dense[0]
    for j in range(nq):
        start[j] = q[j]
    for j in range(nq, size):
        start[j] = v[j - nq]
    normalize(tree, start[:nq])
    if course.path[0].begun:
        for j in range(size):
            k[0, j] = ends[0, j]
    else:
        rates(tree, gravity, loads, start[:nq], start[nq:], work, k[0])
    for stage in range(1, 16):
        add_up(STAGES[stage], stage, k, h, y)
        for j in range(size):
            y[j] += start[j]
        normalize(tree, y[:nq])
        if stage == 12:
            for j in range(size):
                dense[1, j] = y[j]
        rates(tree, gravity, loads, y[:nq], y[nq:], work, k[stage])
    for j in range(size):
        dense[1, j] -= start[j]
        dense[2, j] = h * k[0, j] - dense[1, j]
        dense[3, j] = 2 * dense[1, j] - h * (k[12, j] + k[0, j])
        ends[0, j], ends[1, j] = k[0, j], k[12, j]
    for row in range(4):
        add_up(CONTINUED[row], 16, k, h, dense[4 + row])
    return step_error(k, h, nq, y)


@compiled
def along(tree: np.ndarray, course: Course, time: float, q: np.ndarray, v: np.ndarray) -> None:
    """Coordinates and velocities at an instant of the path, s from its start."""
    nq, dense = len(q), course.dense
    share = time / course.path[0].length
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
def begin_path(s: System, r: Room, course: Course, loads: np.ndarray, tolerance: float,
               longest: float) -> bool:
    """Make a path from where all is, as long as its error allows, at most ``longest`` s. False:
    none was found that errs little enough.
    """
    path = course.path[0]
    pose(s.tree, course.q, course.v, r.work)
    if path.next <= 0:
        fast = 1e-9
        for i in range(len(s.tree)):
            move = r.work.moves[i]
            fast = max(fast, move[0] ** 2 + move[1] ** 2 + move[2] ** 2)
        path.next = FIRST_TURN / math.sqrt(fast)
    h, before = min(longest, path.next), math.inf
    for _ in range(30):
        error = path_step(s, r, loads, course, h)
        r.tally[0].flights += 1
        ratio = error / tolerance
        factor = SAFETY / math.sqrt(math.sqrt(math.sqrt(ratio))) if ratio > 0 else LONGER
        good = ratio <= 1 or (HELPED * before < error < math.inf)
        path.length, path.error = h, error
        path.next = h * min(LONGER, max(SHORTER, factor))
        if good:
            path.valid, path.along, path.event = 1, 0.0, math.inf
            return True
        before, h = error, min(h * SHORTER if error == math.inf else path.next, longest)
        path.begun = 1 if math.isfinite(course.ends[0, 0]) else 0
    path.valid = 0
    return False


@compiled
def point_velocity(work: Work, i: int, q: np.ndarray, root: int, point: np.ndarray,
                   n: np.ndarray) -> float:
    """Velocity of a bone's point (3,) m in the world along n; ``root``: where in q its doll's root
    stands. Work is posed.
    """
    m = work.moves[i]
    x, y, z = cross(m[0], m[1], m[2], point[0] - q[root], point[1] - q[root + 1],
                    point[2] - q[root + 2])
    return n[0] * (m[3] + x) + n[1] * (m[4] + y) + n[2] * (m[5] + z)


@compiled
def accelerations_of(s: System, r: Room, course: Course, q: np.ndarray, v: np.ndarray) -> float:
    """Acceleration, m/s^2, that no point exceeds on the path, as its ends tell; q, v: room."""
    bones, h = len(s.tree), course.path[0].length
    along(s.tree, course, 0.0, q, v)
    pose(s.tree, q, v, r.work)
    for i in range(bones):
        x, y, z, w = bone_velocity(r.work, i)
        r.own[i, 0], r.own[i, 1], r.own[i, 2], r.own[i, 3] = x, y, z, w
        r.own[i, 4] = 0.0
    along(s.tree, course, h, q, v)
    pose(s.tree, q, v, r.work)
    for k in range(len(s.geoms)):
        i = s.geoms[k].bone
        r.own[i, 4] = max(r.own[i, 4], s.geoms[k].reach)
    most = 0.0
    for i in range(bones):
        x, y, z, w = bone_velocity(r.work, i)
        own, reach = r.own[i], r.own[i, 4]
        size = math.sqrt((x - own[0]) ** 2 + (y - own[1]) ** 2 + (z - own[2]) ** 2) / h
        size += abs(w - own[3]) / h * reach + 2 * max(w, own[3]) ** 2 * reach
        most = max(most, size)
    g = math.sqrt(s.gravity[0] ** 2 + s.gravity[1] ** 2 + s.gravity[2] ** 2)
    return STEADY * (most + g) + 1e-3


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
              armed: np.ndarray, acceleration: float, ends: np.ndarray) -> float:
    """Least time, s, until a gap may be gone; work is posed at q and v, geoms are placed.

    ``ends`` (2, nq + nv): rates at the path's ends, for those of the limited joints.
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
        least = min(least, time_to_close(due(gaps, armed, n + k), closing, 2 * acceleration))
    return least


@compiled
def pair_closing(s: System, r: Room, q: np.ndarray, k: int, gap: float) -> float:
    """Speed, m/s, at which a pair's gap closes, or a bound above it where they are far apart."""
    pair = s.pairs[k]
    a, b = s.geoms[pair.a], s.geoms[pair.b]
    if gap < NEAR:
        found = collide(a.kind, a.size, r.at[pair.a], r.turn[pair.a], b.kind, b.size,
                        r.at[pair.b], r.turn[pair.b], max(gap, 0.0) + 1e-4, r.table)
        if found:
            best = 0
            for j in range(1, found):
                if r.table[j, 6] < r.table[best, 6]:
                    best = j
            point, n = r.table[best, :3], r.table[best, 3:6]
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
    acceleration = accelerations_of(s, r, course, q, v)
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
        step = time_free(s, r, q, v, gaps, armed, acceleration, course.ends)
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
