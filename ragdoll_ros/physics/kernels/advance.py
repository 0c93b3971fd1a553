"""A stretch of motion from end to end: flight, touches, impacts, steps between them."""
from __future__ import annotations

import math

import numpy as np

from .compiling.bundle import bundle_at
from .compiling.decorators import JOBS, REAL, compiled, entry
from .contact.gaps import update_kinematics_and_gaps, enable_separated_pairs
from .dynamics.forward_dynamics import forward_kinematics
from .flight.first_contact import find_first_contact
from .flight.flight import follow_dense_step, can_fly
from .flight.dense_step import begin_dense_step
from .maths.quaternion import cross, times
from .stepping.step_control import step_to_impact
from .stepping.impact import impact
from .stepping.momentum import sum_dolls
from .system import CLUSTER_STATE, WORKSPACE, SYSTEM, ClusterState, Workspace, System

LONGEST = 0.05
"""s of a path."""

MOST_EVENTS = 200
"""Impacts in one stretch of a doll by itself, over the cube of their number of several that go on
together: from then on no instant of a touch is sought, so that many do not cost their square."""

system_at, room_at, course_at = bundle_at(SYSTEM), bundle_at(WORKSPACE), bundle_at(CLUSTER_STATE)


@compiled
def is_finite(values: np.ndarray) -> bool:
    """Whether all values (k,) are, and their sum."""
    total = 0.0
    for j in range(len(values)):
        total += values[j]
    return math.isfinite(total)


@compiled
def write_bone_states(s: System, r: Workspace, q: np.ndarray, v: np.ndarray, rows: np.ndarray) -> None:
    """Position, orientation, linear and angular velocity (n, 13) of all bones, world frame."""
    forward_kinematics(s.tree, q, v, r.kinematics)
    for i in range(len(s.tree)):
        bone, turn, move, centre = s.tree[i], r.kinematics.orientations[i], r.kinematics.spatial_velocities[i], r.kinematics.positions[i]
        row, root, bind = rows[bone.bone], s.tree[s.body_root[i]].q_start, bone.inertial_orientation
        row[3], row[4], row[5], row[6] = times(turn[0], turn[1], turn[2], turn[3], bind[0],
                                               bind[1], bind[2], bind[3])
        x, y, z = cross(move[0], move[1], move[2], centre[0], centre[1], centre[2])
        row[7], row[8], row[9] = move[3] + x, move[4] + y, move[5] + z
        for k in range(3):
            row[k] = q[root + k] + centre[k]
            row[10 + k] = move[k]


@compiled
def advance_cluster(s: System, r: Workspace, course: ClusterState, duration: float, step: float,
          tolerance: float) -> None:
    """Take the course of one cluster on by ``duration`` s; see advance()."""
    q, v, path, tally = course.q, course.v, course.dense_step[0], r.stats[0]
    loads, springs, time, events = course.loads, course.springs, 0.0, 0
    most = MOST_EVENTS // len(r.external) ** 3
    flies = s.flight_enabled[0] > 0 and len(springs) == 0
    parted = enable_separated_pairs(s, r, q, v)
    if parted:
        path.valid = path.first_rate_known = 0
    if parted or duration == 0.0:
        update_kinematics_and_gaps(s, r, q, v, r.gaps, math.inf, r.gaps)
        tally.gaps_current = 1
    # What is no number would be gone through in the finest steps, which takes a second.
    while time < duration - 1e-12 and is_finite(q) and is_finite(v):
        left = duration - time
        if not path.valid and not tally.gaps_current:
            update_kinematics_and_gaps(s, r, q, v, r.gaps, math.inf, r.gaps)
            tally.gaps_current = 1
        if (not path.valid and flies and events < most
                and can_fly(s, r, course, loads, step)
                and begin_dense_step(s, r, course, loads, tolerance,
                               min(left, LONGEST) if len(loads) else LONGEST)):
            find_first_contact(s, r, course)
            tally.contact_count = 0
        if path.valid:
            gone, touched = follow_dense_step(s, r, course, left, loads)
            tally.gaps_current = 0
            if touched:
                update_kinematics_and_gaps(s, r, q, v, r.gaps, math.inf, r.gaps)
                tally.gaps_current = 1
        else:
            if not flies or events >= most:
                update_kinematics_and_gaps(s, r, q, v, r.gaps, math.inf, r.gaps)
            h = left / max(1, math.ceil(left / step - 1e-9))
            gone, touched = step_to_impact(s, r, course, h, loads, springs, time, step,
                                          events < most)
            path.first_rate_known, path.next_length = 0, 0.0
        time += gone
        tally.ended_without_impact = 0 if touched else 1
        if touched:
            impact(s, r, q, v, events < most)
            events += 1
    write_bone_states(s, r, q, v, course.bone_states)
    sum_dolls(s, q, r, course.doll_sums)


@entry(JOBS, REAL, REAL, REAL)
def advance(jobs: np.ndarray, duration: float, step: float, tolerance: float) -> None:
    """Take clusters on by ``duration`` s, each by itself, and enter in their courses the rows and
    sums at the end. ``jobs`` (k, 3): addresses of their bundles, system, room and course. ``step``:
    s of a step on the ground; ``tolerance``: m or rad by which a path's end may err.
    """
    for k in range(len(jobs)):
        advance_cluster(system_at(jobs[k, 0]), workspace_at(jobs[k, 1]), cluster_state_at(jobs[k, 2]), duration, step,
              tolerance)
