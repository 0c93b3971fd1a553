"""A stretch of motion from end to end: flight, touches, impacts, steps between them."""
from __future__ import annotations

import math

import numpy as np

from .compiling.bundle import bundle_at
from .compiling.decorators import JOBS, REAL, compiled, entry
from .contact.gaps import look, part_pairs
from .dynamics.forward import pose
from .flight.event import find_event
from .flight.fly import fly, may_fly
from .flight.path import begin_path
from .maths.quaternion import cross, times
from .stepping.control import step_or_touch
from .stepping.impact import impact
from .stepping.momentum import sum_dolls
from .system import COURSE, ROOM, SYSTEM, Course, Room, System

LONGEST = 0.05
"""s of a path."""

MOST_EVENTS = 200
"""Impacts in one stretch of a doll by itself, over the cube of their number of several that go on
together: from then on no instant of a touch is sought, so that many do not cost their square."""

system_at, room_at, course_at = bundle_at(SYSTEM), bundle_at(ROOM), bundle_at(COURSE)


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
    if parted or duration == 0.0:
        look(s, r, q, v, r.gaps, math.inf, r.gaps)
        tally.seen = 1
    # What is no number would be gone through in the finest steps, which takes a second.
    while time < duration - 1e-12 and is_finite(q) and is_finite(v):
        left = duration - time
        if not path.valid and not tally.seen:
            look(s, r, q, v, r.gaps, math.inf, r.gaps)
            tally.seen = 1
        if (not path.valid and flies and events < most
                and may_fly(s, r, course, loads, step)
                and begin_path(s, r, course, loads, tolerance,
                               min(left, LONGEST) if len(loads) else LONGEST)):
            find_event(s, r, course)
            tally.contacts = 0
        if path.valid:
            gone, touched = fly(s, r, course, left, loads)
            tally.seen = 0
            if touched:
                look(s, r, q, v, r.gaps, math.inf, r.gaps)
                tally.seen = 1
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
