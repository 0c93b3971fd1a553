"""Whether all that touches comes apart, and the flight along a path to its end or first touch."""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..contact.find_contacts import find_contacts
from ..contact.gaps import TOUCHING, update_kinematics_and_gaps, place_geoms
from ..dynamics.forward_dynamics import forward_kinematics, state_derivative
from ..stepping.step_control import clear_contact_accelerations
from ..stepping.work import power
from ..system import ClusterState, Workspace, System
from .first_contact import time_until_contact_possible
from .dense_step import evaluate_dense_step, point_velocity

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
def can_fly(s: System, r: Workspace, course: ClusterState, loads: np.ndarray, step: float) -> bool:
    """Whether all that touches comes apart, and for long enough; r.gaps are those of now."""
    q, v, tally, armed = course.q, course.v, r.stats[0], r.armed
    g = math.sqrt(s.gravity[0] ** 2 + s.gravity[1] ** 2 + s.gravity[2] ** 2)
    least = NOTHING * g * s.doll_masses[0] * tally.last_dt
    for i in range(tally.contact_count):
        if tally.ended_without_impact and course.contacts[i].impulse[0] > least:
            return False
    forward_kinematics(s.tree, q, v, r.kinematics)
    place_geoms(s.tree, s.body_root, s.geoms, r.kinematics, q, r.geom_positions, r.geom_rotations)
    m = find_contacts(s, q, r, r.gaps, TOUCHING)
    leaning = False
    for i in range(m):
        c = r.contacts[i]
        if c.kind == 1:
            leaning |= c.normal[0] * v[c.a] < APART
            if c.normal[0] * v[c.a] < -STILL:
                return False
            continue
        apart = point_velocity(r.kinematics, c.a, q, s.tree[s.body_root[c.a]].q_start, c.point, c.normal)
        if c.b >= 0:
            apart -= point_velocity(r.kinematics, c.b, q, s.tree[s.body_root[c.b]].q_start, c.point, c.normal)
        if apart < APART:
            return False
    if leaning:
        state_derivative(s.tree, s.gravity, loads, q, v, r.kinematics, r.row)
        for i in range(m):
            c = r.contacts[i]
            if c.kind == 1 and c.normal[0] * v[c.a] < APART and (
                    c.normal[0] * r.row[len(q) + c.a] < -STILL):
                return False
        forward_kinematics(s.tree, q, v, r.kinematics)
    if m == 0 or len(s.tree) == len(r.external):
        return True
    update_kinematics_and_gaps(s, r, q, v, r.gaps, math.inf, r.gaps)
    fast = 0.0
    for k in range(len(s.geoms)):
        move = r.kinematics.spatial_velocities[s.geoms[k].bone]
        fast = max(fast, (move[0] ** 2 + move[1] ** 2 + move[2] ** 2) * s.geoms[k].reach)
    for j in range(len(armed)):
        armed[j] = 1.0 if r.gaps[j] > TOUCHING else 0.0
    return time_until_contact_possible(s, r, q, v, r.gaps, armed, g + 2 * fast + 1e-3, g + 2 * fast + 1e-3,
                     course.end_rates) > WORTH * step


@compiled
def follow_dense_step(s: System, r: Workspace, course: ClusterState, left: float, loads: np.ndarray) -> tuple[float, bool]:
    """Go along the path by ``left`` s or to its end or its first touch; the time gone, and whether
    something touches.
    """
    path = course.dense_step[0]
    end = min(path.length, path.event_time)
    gone = min(left, end - path.elapsed)
    if len(loads):
        q2, v2 = r.states[1], r.vectors[0]
        for place, weight in GAUSS:
            evaluate_dense_step(s.tree, course, path.elapsed + place * gone, q2, v2)
            forward_kinematics(s.tree, q2, v2, r.kinematics)
            for k in range(len(loads)):
                r.stats[0].work_pushes += weight * gone * power(s.tree, r.kinematics, loads[k], False)
    path.elapsed += gone
    clear_contact_accelerations(course)
    evaluate_dense_step(s.tree, course, path.elapsed, course.q, course.v)
    if path.elapsed < end - 1e-15:
        return gone, False
    path.valid = 0
    touched = path.event_time <= path.length
    path.first_rate_known = 0 if touched else 1
    if touched:
        path.next_length = 0.0
    else:
        for j in range(course.end_rates.shape[1]):
            course.end_rates[0, j] = course.end_rates[1, j]
    return gone, touched
