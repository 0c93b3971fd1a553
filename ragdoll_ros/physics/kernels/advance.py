"""A stretch of a scene's motion from end to end: flight, touches, impacts, steps between them."""
from __future__ import annotations

import math

import numpy as np

from .bundle import bundle_at
from .contact import BEYOND, TOUCHING, find_contacts, look, of_limit, part_pairs
from .dynamics import pose, rates
from .flight import along, begin_path, find_event, point_velocity, time_free
from .forces import power
from .impact import impact
from .machine import JOBS, REAL, compiled, entry
from .momentum import SMALL, inner_energy, sum_dolls, take_out, total_energy
from .quaternion import cross, times
from .step import (
    DEEP,
    PAID,
    STEP_TOLERANCE,
    begin_step,
    contact_step,
    jammed,
    settle,
)
from .system import COURSE, ROOM, SYSTEM, Course, Room, System
from .touch import SUNK, between, narrow, open_bracket, touched

APART = 5e-3
"""m/s or rad/s at which what touches comes apart for a flight: to 1.3 um under gravity, which is
what TOUCHING can tell."""

STILL = 1e-6
"""rad/s, or rad/s^2, at which a joint that leans on its limit does not press on it."""

NOTHING = 1e-9
"""Share of a doll's weight below which nothing presses on anything: what falls with all its joints
at their limits presses on them by rounding alone."""

WORTH = 6
"""Steps on the ground that cost as much as one of flight."""

LONGEST = 0.05
"""s of a path."""

TRIES = 16
"""At a step that is to end at a touch, and is to make no energy."""

FINEST = 0.01
"""Share of a step below which it is not made shorter to make no energy; what makes some all the
same is counted."""

SLIGHT = 1e-6
"""Share of the heft that a step may gain where the motion can pay for it: of what hardly moves, the
energy of a step says little about its error."""

NOISE = 1e-10
"""Share of the heft that solving to a tolerance may give a step."""

GAIN = 1e-4
"""Share of the kinetic energy that a step may gain."""

MET, MET_EACH, MET_TURN = 5e-3, 5e-5, 0.05
"""m, at the most and for each doll of those that go on together, and rad: where touches are not
sought, steps are halved, down to the share COARSEST, to keep what meets from ending deeper."""

COARSEST = 0.03

MOST_EVENTS = 200
"""Impacts in one stretch of a doll by itself, over the cube of their number of several that go on
together: from then on no instant of a touch is sought, so that many do not cost their square."""

GAUSS = ((0.046910077030668, 0.118463442528095), (0.230765344947158, 0.239314335249683),
         (0.5, 0.284444444444444), (0.769234655052842, 0.239314335249683),
         (0.953089922969332, 0.118463442528095))
"""Places and weights of Gauss and Legendre's rule of five points on (0, 1)."""


system_at, room_at, course_at = bundle_at(SYSTEM), bundle_at(ROOM), bundle_at(COURSE)


@compiled
def may_fly(s: System, r: Room, course: Course, loads: np.ndarray, step: float) -> bool:
    """Whether all that touches comes apart, and for long enough; r.gaps are those of now."""
    q, v, tally, armed = course.q, course.v, r.tally[0], r.armed
    g = math.sqrt(s.gravity[0] ** 2 + s.gravity[1] ** 2 + s.gravity[2] ** 2)
    least = NOTHING * g * s.doll_masses[0] * tally.lasted
    for i in range(tally.contacts):
        if tally.settled and course.known[i].impulse[0] > least:
            return False
    look(s, r, q, v, r.gaps, math.inf, r.gaps)
    m = find_contacts(s, q, r, r.gaps, TOUCHING)
    leaning = False
    for i in range(m):
        c = r.contacts[i]
        if c.kind == 1:
            leaning |= c.normal[0] * v[c.a] < APART
            if c.normal[0] * v[c.a] < -STILL:
                return False
            continue
        apart = point_velocity(r.work, c.a, q, s.tree[s.root_of[c.a]].q, c.point, c.normal)
        if c.b >= 0:
            apart -= point_velocity(r.work, c.b, q, s.tree[s.root_of[c.b]].q, c.point, c.normal)
        if apart < APART:
            return False
    if leaning:
        rates(s.tree, s.gravity, loads, q, v, r.work, r.row)
        for i in range(m):
            c = r.contacts[i]
            if c.kind == 1 and c.normal[0] * v[c.a] < APART and (
                    c.normal[0] * r.row[len(q) + c.a] < -STILL):
                return False
        pose(s.tree, q, v, r.work)
    if m == 0 or len(s.tree) == len(r.given):
        return True
    fast = 0.0
    for k in range(len(s.geoms)):
        move = r.work.moves[s.geoms[k].bone]
        fast = max(fast, (move[0] ** 2 + move[1] ** 2 + move[2] ** 2) * s.geoms[k].reach)
    for j in range(len(armed)):
        armed[j] = 1.0 if r.gaps[j] > TOUCHING else 0.0
    return time_free(s, r, q, v, r.gaps, armed, g + 2 * fast + 1e-3,
                     course.ends) > WORTH * step


@compiled
def fly(s: System, r: Room, course: Course, left: float, loads: np.ndarray) -> tuple[float, bool]:
    """Go along the path by ``left`` s or to its end or its first touch; the time gone, and whether
    something touches.
    """
    path = course.path[0]
    end = min(path.length, path.event)
    gone = min(left, end - path.along)
    if len(loads):
        q2, v2 = r.states[1], r.vectors[0]
        for place, weight in GAUSS:
            along(s.tree, course, path.along + place * gone, q2, v2)
            pose(s.tree, q2, v2, r.work)
            for k in range(len(loads)):
                r.tally[0].pushed += weight * gone * power(s.tree, r.work, loads[k], False)
    path.along += gone
    forget_reaction(course)
    along(s.tree, course, path.along, course.q, course.v)
    if path.along < end - 1e-15:
        return gone, False
    path.valid = 0
    touched = path.event <= path.length
    path.begun = 0 if touched else 1
    if touched:
        path.next = 0.0
    else:
        for j in range(course.ends.shape[1]):
            course.ends[0, j] = course.ends[1, j]
    return gone, touched


@compiled
def step_or_touch(s: System, r: Room, course: Course, h: float, loads: np.ndarray,
                  springs: np.ndarray, since: float, step: float,
                  seek: bool) -> tuple[float, bool]:
    """Go on by h s, or to the first touch that is fast; the time gone, and whether one was met.

    r.gaps are those at q, and again at the end. A step that makes much energy, or presses one thing
    deep into another, is too long for what turns: it is gone again, half as long. The little energy
    that others make is taken out of the motion. Where touches are not to be sought, what meets in
    the step is held or thrown back in it, as restitution says: it is gone again with that.
    """
    end_q, end_v, tally = r.states[2], r.vectors[4], r.tally[0]
    length, hit, m = min(h, tally.next) if tally.next > 0 else h, False, 0
    tally.next = 2 * length if 2 * length < step else 0.0
    begin_step(s, r, course, loads)
    take_over(r.met, r.gaps)
    open_bracket(r)
    r.unsought[0] = 0.0 if seek else 1.0
    held, moving = total_energy(r.before)
    pushed, handed, lifted = tally.pushed, tally.handed, tally.lifted
    for turn in range(TRIES):
        tally.pushed, tally.handed, tally.lifted = pushed, handed, lifted
        m = contact_step(s, r, course, length, loads, springs, since, end_q, end_v)
        settle(s, r, course, length, loads, springs, since, m, end_q, end_v)
        now, speed = total_energy(r.after)
        work = tally.pushed - pushed + tally.handed - handed
        gained = now - held - work
        much = tolerated(s, r, m, length, max(moving, speed), work)
        if turn < TRIES - 1 and length > FINEST * step and (
                not gained - r.lift[0] <= much or sinks(s, r)
                or (not seek and length > COARSEST * step and meets_deep(s, r))):
            length, hit = length / 2, False
            tally.next = length
            take_over(r.met, r.gaps)
            open_bracket(r)
            forget_reaction(course)
            continue
        if not seek and turn < TRIES - 1 and meet(r):
            continue
        sunk, landed, fast = touched(s, r, length)
        hit = seek and fast
        if seek and turn < TRIES - 1 and narrow(s, r, length, sunk, landed):
            length = between(r)
            continue
        gained -= tally.lifted - lifted
        if not gained <= much:
            tally.gains += 1
        if gained > much or 0 < gained < SMALL * inner_energy(s, r):
            take_out(s, r, gained, end_q, end_v)
        break
    if length > 0.1 * h:
        for i in range(m):
            course.known[i] = r.contacts[i]
        tally.contacts, tally.lasted = m, length
    take_over(course.q, end_q)
    take_over(course.v, end_v)
    take_over(r.gaps, r.later)
    return length, hit


@compiled
def forget_reaction(course: Course) -> None:
    """Nothing is known of what contacts will do."""
    for j in range(len(course.reaction)):
        course.reaction[j] = 0.0


@compiled
def meets_deep(s: System, r: Room) -> bool:
    """Whether something met in the step just gone that would end deep within the other."""
    deep = min(MET, MET_EACH * len(r.given))
    for j in range(len(r.gaps)):
        most = MET_TURN if of_limit(s, r.gaps, j) else deep
        if r.met[j] > TOUCHING and r.later[j] < -most:
            return True
    return False


@compiled
def meet(r: Room) -> bool:
    """Let what met in the step just gone be of those that touch in it; whether there is any."""
    some = False
    for j in range(len(r.met)):
        if r.met[j] > TOUCHING and r.later[j] < SUNK:
            r.met[j] = r.later[j]
            some = True
    return some


@compiled
def take_over(to: np.ndarray, values: np.ndarray) -> None:
    """Copy values (k,)."""
    for j in range(len(to)):
        to[j] = values[j]


@compiled
def tolerated(s: System, r: Room, m: int, h: float, kinetic: float, work: float) -> float:
    """Energy, J, that a step of h s with m contacts may make: a share of what moves, of what hardly
    moves a share of the heft, both as far as the motion can pay for it, and what the tolerances of
    solving make: that of contacts times the sum of all impulses.
    """
    total = 0.0
    for i in range(m):
        for e in range(r.contacts[i].kind):
            total += abs(r.contacts[i].impulse[e])
    share = max(GAIN * (kinetic + abs(work)), min(PAID * kinetic, SLIGHT * s.heft[0]))
    return min(share, (SMALL - PAID) * inner_energy(s, r)) + (
        NOISE * s.heft[0] + max(10 * STEP_TOLERANCE, r.left[0]) * min(total, jammed(s, r, h)))


@compiled
def sinks(s: System, r: Room) -> bool:
    """Whether something that touched is deep at the step's end, and deeper by a tenth of that than
    at its start.
    """
    for j in range(len(r.gaps)):
        most = BEYOND if of_limit(s, r.gaps, j) else DEEP
        if r.later[j] < -most and r.gaps[j] <= TOUCHING and r.later[j] < r.gaps[j] - most / 10:
            return True
    return False


@compiled
def is_finite(values: np.ndarray) -> bool:
    """Whether all values (k,) are, and their sum."""
    total = 0.0
    for j in range(len(values)):
        total += values[j]
    return math.isfinite(total)


@compiled
def observe(s: System, r: Room, q: np.ndarray, v: np.ndarray, rows: np.ndarray) -> None:
    """Position, orientation, linear and angular velocity (n, 13) of all bones, world frame."""
    pose(s.tree, q, v, r.work)
    for i in range(len(s.tree)):
        bone, turn, move, centre = s.tree[i], r.work.turns[i], r.work.moves[i], r.work.centres[i]
        row, root, bind = rows[bone.bone], s.tree[s.root_of[i]].q, bone.bind
        row[3], row[4], row[5], row[6] = times(turn[0], turn[1], turn[2], turn[3], bind[0],
                                               bind[1], bind[2], bind[3])
        x, y, z = cross(move[0], move[1], move[2], centre[0], centre[1], centre[2])
        row[7], row[8], row[9] = move[3] + x, move[4] + y, move[5] + z
        for k in range(3):
            row[k] = q[root + k] + centre[k]
            row[10 + k] = move[k]


@compiled
def go_on(s: System, r: Room, course: Course, duration: float, step: float,
          tolerance: float) -> None:
    """Take the course of one cluster on by ``duration`` s; see advance()."""
    q, v, path, tally = course.q, course.v, course.path[0], r.tally[0]
    loads, springs, time, events = course.loads, course.springs, 0.0, 0
    most = MOST_EVENTS // len(r.given) ** 3
    flies = s.flies[0] > 0 and len(springs) == 0
    parted = part_pairs(s, r, q, v)
    if parted:
        path.valid = path.begun = 0
    if parted or not tally.seen or duration == 0.0:
        look(s, r, q, v, r.gaps, math.inf, r.gaps)
        tally.seen = 1
    # What is no number would be gone through in the finest steps, which takes a second.
    while time < duration - 1e-12 and is_finite(q) and is_finite(v):
        left = duration - time
        if (not path.valid and flies and events < most
                and may_fly(s, r, course, loads, step)
                and begin_path(s, r, course, loads, tolerance,
                               min(left, LONGEST) if len(loads) else LONGEST)):
            find_event(s, r, course)
            tally.contacts = 0
        if path.valid:
            gone, touched = fly(s, r, course, left, loads)
            if touched:
                look(s, r, q, v, r.gaps, math.inf, r.gaps)
        else:
            if not flies or events >= most:
                look(s, r, q, v, r.gaps, math.inf, r.gaps)
            h = left / max(1, math.ceil(left / step - 1e-9))
            gone, touched = step_or_touch(s, r, course, h, loads, springs, time, step,
                                          events < most)
            path.begun, path.next = 0, 0.0
        time += gone
        tally.settled = 0 if touched else 1
        if touched:
            impact(s, r, q, v, events < most)
            events += 1
    observe(s, r, q, v, course.rows)
    sum_dolls(s, q, r, course.sums)


@entry(JOBS, REAL, REAL, REAL)
def advance(jobs: np.ndarray, duration: float, step: float, tolerance: float) -> None:
    """Take clusters on by ``duration`` s, each by itself, and enter in their courses the rows and
    sums at the end. ``jobs`` (k, 3): addresses of their bundles, system, room and course. ``step``:
    s of a step on the ground; ``tolerance``: m or rad by which a path's end may err.
    """
    for k in range(len(jobs)):
        go_on(system_at(jobs[k, 0]), room_at(jobs[k, 1]), course_at(jobs[k, 2]), duration, step,
              tolerance)
