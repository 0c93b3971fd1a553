"""Whether all that touches comes apart, and the flight along a path to its end or first touch."""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..contact.find import find_contacts
from ..contact.gaps import TOUCHING, look, place_geoms
from ..dynamics.forward import pose, rates
from ..stepping.control import forget_reaction
from ..stepping.work import power
from ..system import Course, Room, System
from .event import time_free
from .path import along, point_velocity

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

GAUSS = ((0.046910077030668, 0.118463442528095), (0.230765344947158, 0.239314335249683),
         (0.5, 0.284444444444444), (0.769234655052842, 0.239314335249683),
         (0.953089922969332, 0.118463442528095))
"""Places and weights of Gauss and Legendre's rule of five points on (0, 1)."""


@compiled
def may_fly(s: System, r: Room, course: Course, loads: np.ndarray, step: float) -> bool:
    """Whether all that touches comes apart, and for long enough; r.gaps are those of now."""
    q, v, tally, armed = course.q, course.v, r.tally[0], r.armed
    g = math.sqrt(s.gravity[0] ** 2 + s.gravity[1] ** 2 + s.gravity[2] ** 2)
    least = NOTHING * g * s.doll_masses[0] * tally.lasted
    for i in range(tally.contacts):
        if tally.settled and course.known[i].impulse[0] > least:
            return False
    pose(s.tree, q, v, r.work)
    place_geoms(s.tree, s.root_of, s.geoms, r.work, q, r.at, r.turn)
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
    look(s, r, q, v, r.gaps, math.inf, r.gaps)
    fast = 0.0
    for k in range(len(s.geoms)):
        move = r.work.moves[s.geoms[k].bone]
        fast = max(fast, (move[0] ** 2 + move[1] ** 2 + move[2] ** 2) * s.geoms[k].reach)
    for j in range(len(armed)):
        armed[j] = 1.0 if r.gaps[j] > TOUCHING else 0.0
    return time_free(s, r, q, v, r.gaps, armed, g + 2 * fast + 1e-3, g + 2 * fast + 1e-3,
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
