"""Advance clusters of dolls by a time: the steps of the algorithm in order.

One tick of a cluster, and what its stages read and write:

    advance ── for each cluster: advance_cluster
      enable_separated_pairs     q, excluded -> excluded          pairs that overlapped at the start
      integrate_positions        q, v -> q                        if all bodies are kinematic
      or
      update_kinematics_and_gaps q, v -> kinematics, gaps         narrow phase, if not current
      follow_twist               q, gaps -> v                     a kinematic body's twist changed
      until the time is up:
        can_fly                  gaps, contacts, v                no contact, or all separate?
        begin_dense_step         q, v, loads -> dense_step        DOP853 with dense output
        find_first_contact       dense_step -> event_time         conservative advancement
        follow_dense_step        dense_step -> q, v               to the first contact or the end
      or
        begin_contact_step       q, v -> start contacts, their points, sums_before
        approaches_fast          start contacts                   an impact first?
        step_to_impact           q, v, gaps -> q, v, gaps         step control, time of impact
          contact_step           -> q_end, v_end                  Moreau's centered scheme
            unconstrained_velocity  middle, loads, springs -> v_free, factor of the mass matrix
            find_contacts           middle, gaps_active -> contacts
            warm_start              last contacts -> impulses
            set_slip_friction       middle, impulses -> friction points of faces that slip
            solve_contacts          contacts, v_free -> v_change, correction   by islands
          finish_step            v_end, correction -> q_end, v_end, gaps_end   position correction
          log_impacts               contacts -> impact_log          where impacts are not sought
          update_bracket, next_trial_step   gaps_end -> length of the next trial
      and where something has met:
        impact                   q, gaps -> v                     restitution, friction
          log_impacts               contacts -> impact_log          where a log is kept
      write_bone_states, sum_dolls   q, v -> bone_states, doll_sums

The broad phase is in engine/rigid/broad_phase.py, sleep in physics/sleeping.py. In all
kernels s is the System, ws the Workspace, kin a Kinematics, m a number of contacts, n of their
rows, h the length of a step, s; ``found``: ws.contacts.found, ``dynamics``: ws.step.dynamics.
"""
from __future__ import annotations

import math

import numpy as np

from .cluster_state import CLUSTER_STATE, ClusterState
from .compiling.bundle import bundle_at
from .compiling.cycles import cycles
from .compiling.decorators import ADDRESS, REAL, compiled, entry
from .contact.gaps import (enable_separated_pairs, label_reachable,
                           update_kinematics_and_gaps)
from .dynamics.body import MOVED
from .dynamics.kinematics import (Kinematics, forward_kinematics, inertial_frame,
                                  integrate_positions, put_quat, root_position, velocity_at)
from .flight.dense_step import begin_dense_step
from .flight.first_contact import find_first_contact
from .flight.flight import can_fly, follow_dense_step
from .maths.vectors import add, put, vec
from .stepping.contact_step import approaches_fast, begin_contact_step
from .stepping.impact import follow_twist, impact
from .stepping.local_error import forget_accelerations
from .stepping.momentum import sum_dolls
from .stepping.step_control import step_to_impact
from .stepping.time_of_impact import LANDED
from .system import System, system_at
from .workspace import WORKSPACE, Workspace

LONGEST_FLIGHT = 0.05
"""s: the longest step of flight that is tried."""

FLIGHT_WORK, MIN_FLIGHT_STEPS = 7000, 100
"""Steps of flight that may be tried in one tick, or in its part between two changes of the pushes,
times the number of bodies, and their least number. After these, as many more are tried with the
tolerance times CUT_TOLERANCE, which flights_cut counts; then contact steps alone."""

CUT_TOLERANCE = 1e6
"""It makes steps of order 8 5.6 times as long. Only bodies that turn at 1000 rad/s and more need
that many steps."""

MAX_IMPACTS, IMPACT_WORK, MIN_IMPACTS = 200, 2_000_000, 8
"""Times of impact that are sought in a tick, at most and over the cube of the number of bodies, so
that many bodies do not cost their cube; none where they would be fewer than the least number. From
then on what meets within a step is a contact of it, with restitution."""

workspace_at, cluster_state_at = bundle_at(WORKSPACE), bundle_at(CLUSTER_STATE)


@compiled
def is_finite(values: np.ndarray) -> bool:
    """Whether the sum of ``values`` (k,) is finite; it is not if a value is not."""
    total = 0.0
    for j in range(len(values)):
        total += values[j]
    return math.isfinite(total)


@compiled
def write_bone_states(s: System, kin: Kinematics, q: np.ndarray, v: np.ndarray,
                      states: np.ndarray) -> None:
    """Write to ``states`` (n, 13), by bone, world frame: position of the center of mass,
    orientation x, y, z, w of the principal axes, velocity of the center of mass, angular velocity.
    ``kin`` becomes that of q and v.
    """
    forward_kinematics(s.tree, q, v, kin)
    for i in range(len(s.tree)):
        body = s.tree[i]
        state, at = states[body.bone], vec(kin.positions[i])
        put_quat(state[3:7], inertial_frame(body, kin, i))
        put(state[7:10], velocity_at(kin, i, at))
        put(state[0:3], add(root_position(q, s.tree[s.body_root[i]].q_start), at))
        put(state[10:13], vec(kin.spatial_velocities[i]))


@compiled
def all_moved(tree: np.ndarray) -> bool:
    """Return whether all bodies of ``tree`` (n,) are of the kinematic kind MOVED, see
    dynamics/body.py. Their velocities are then constant.
    """
    moved = True
    for i in range(len(tree)):
        moved &= tree[i].kinematic == MOVED
    return moved


@compiled
def refresh_gaps(s: System, ws: Workspace, cluster: ClusterState) -> None:
    """Write all gaps at cluster.q to ws.gaps and mark them as current; ws.step.end becomes the
    kinematics of q and v.
    """
    start_cycles = cycles()
    update_kinematics_and_gaps(s, ws, ws.step.end, cluster.q, cluster.v, ws.gaps, math.inf,
                               ws.gaps)
    ws.stats[0].gaps_current = 1
    ws.stats[0].ledger.gaps_cycles += cycles() - start_cycles


@compiled
def try_flight(s: System, ws: Workspace, cluster: ClusterState, left: float, nominal: float,
               tolerance: float) -> None:
    """Begin a flight if can_fly(): make a dense step and find its first contact. dense_step.valid,
    which must be 0, becomes 1 if one has begun. ws.gaps must be current. With loads, which may
    change then, the step lasts at most ``left``, s. ``nominal``: length of a contact step, s.
    """
    start_cycles = cycles()
    longest = min(left, LONGEST_FLIGHT) if len(cluster.loads) else LONGEST_FLIGHT
    if can_fly(s, ws, cluster, nominal) and begin_dense_step(s, ws, cluster, tolerance, longest):
        find_first_contact(s, ws, cluster)
        ws.stats[0].contact_count = 0
    ws.stats[0].ledger.flight_cycles += cycles() - start_cycles


@compiled
def advance_cluster(s: System, ws: Workspace, cluster: ClusterState, duration: float,
                    nominal: float, tolerance: float) -> None:
    """Advance one cluster by ``duration`` s; see advance(), whose ``step`` is ``nominal``. Stops
    early if the state is not finite. With springs there is no flight. Two limits, by the number of
    bodies, bound the work. Beyond that of impacts, 0 for many bodies, contact steps no longer seek
    times of impact; beyond MAX_IMPACTS no flight begins. Beyond that of flight steps the tolerance
    is multiplied by CUT_TOLERANCE; after as many more, only contact steps follow.
    """
    q, v, dense, stats = cluster.q, cluster.v, cluster.dense_step[0], ws.stats[0]
    start_cycles, ledger = cycles(), ws.stats[0].ledger
    time, impacts, impact_due = 0.0, 0, True
    cluster.impact_count[0] = 0
    max_impacts = min(MAX_IMPACTS, IMPACT_WORK // len(s.tree) ** 3)
    if max_impacts < MIN_IMPACTS:
        max_impacts = 0
    flight_steps, flights_cut = max(MIN_FLIGHT_STEPS, FLIGHT_WORK // len(s.tree)), False
    max_flight_steps = stats.flight_steps + flight_steps
    flight_possible = s.flight_enabled[0] > 0 and len(cluster.springs) == 0
    separated = enable_separated_pairs(s, ws, ws.step.end, q, v)
    if separated:
        dense.valid = dense.first_rate_known = 0
    if duration > 0.0 and all_moved(s.tree):
        integrate_positions(s.tree, q, v, duration, q)
        stats.gaps_current = stats.twist_changed = 0
        time = duration
    elif separated or duration == 0.0:
        refresh_gaps(s, ws, cluster)
    if duration > 0.0 and stats.twist_changed:
        refresh_gaps(s, ws, cluster)
        follow_twist(s, ws, cluster)
    # A state that is not finite would be integrated in the finest steps, which takes a second.
    while time < duration - 1e-12 and is_finite(q) and is_finite(v):
        left, seek = duration - time, impacts < max_impacts
        if not dense.valid and not stats.gaps_current:
            refresh_gaps(s, ws, cluster)
        if not dense.valid and flight_possible and impacts < MAX_IMPACTS:
            if stats.flight_steps >= max_flight_steps:
                stats.flights_cut += 0 if flights_cut else 1
                flight_possible, flights_cut = not flights_cut, True
                max_flight_steps += flight_steps
                tolerance *= CUT_TOLERANCE
            if flight_possible:
                try_flight(s, ws, cluster, left, nominal, tolerance)
        if dense.valid:
            since = cycles()
            gone, touched = follow_dense_step(s, ws, cluster, left)
            ledger.flight_cycles += cycles() - since
            stats.gaps_current = 0
            if touched:
                refresh_gaps(s, ws, cluster)
        else:
            if not flight_possible or not seek:
                refresh_gaps(s, ws, cluster)
            longest = max(nominal, stats.smooth_dt)
            h = left / max(1, math.ceil(left / longest - 1e-9))
            since = cycles()
            begin_contact_step(s, ws, cluster)
            ledger.begin_cycles += cycles() - since
            gone, touched = 0.0, seek and impact_due and approaches_fast(s, ws, cluster)
            if not touched:
                gone, touched = step_to_impact(s, ws, cluster, h, time, nominal, seek)
            dense.first_rate_known, dense.next_length = 0, 0.0
        time += gone
        stats.ended_without_impact = 0 if touched else 1
        impact_due = True
        if touched:
            since = cycles()
            landed = LANDED if gone > 0.0 else math.inf
            impact_due = impact(s, ws, cluster, time, landed) > 0
            impacts += 1
            ledger.impact_cycles += cycles() - since
            forget_accelerations(cluster)
    write_bone_states(s, ws.step.end, q, v, cluster.bone_states)
    sum_dolls(s, ws, ws.step.end, q, cluster.doll_sums)
    ledger.all_cycles += cycles() - start_cycles


@entry(ADDRESS[::1], REAL[::1], ADDRESS[:, ::1], REAL)
def find_islands(job: np.ndarray, windows: np.ndarray, labels: np.ndarray,
                 touching: float) -> None:
    """Write to ``labels`` (k, d) the islands of a cluster's d dolls for each of k durations
    ``windows``, s: the least index among the dolls that each may touch within that time, directly
    or through others. ``job`` (3,): a row of ``jobs`` of advance(); ``touching``: see there.
    Computes ws.gaps and ws.step.end anew.
    """
    system, workspace, cluster = vec(job)
    s, ws, state = system_at(system), workspace_at(workspace), cluster_state_at(cluster)
    current = ws.stats[0].gaps_current
    ws.step.scalars[0].touching = touching
    refresh_gaps(s, ws, state)
    ws.stats[0].gaps_current = current
    for k in range(len(windows)):
        label_reachable(s, ws, ws.step.end, ws.gaps, windows[k], labels[k])


@entry(ADDRESS[:, ::1], REAL, REAL, REAL, REAL, REAL)
def advance(jobs: np.ndarray, duration: float, step: float, tolerance: float,
            solve_error: float, touching: float) -> None:
    """Advance clusters independently by ``duration`` s and write their bone states and doll sums.
    ``duration`` 0: recompute these and the gaps, and clear the exclusion flags of pairs that have
    separated, see enable_separated_pairs(); q and v stay.

    ``jobs`` (k, 3): addresses of the bundles of system, workspace and state of each. ``step``:
    nominal length of a step in contact, s; ``tolerance``: error of a step of flight, m or rad;
    ``solve_error``: residual of the contact solve as a share of a speed, see Accuracy;
    ``touching``: gap that counts as contact, m or rad.
    """
    for k in range(len(jobs)):
        system, workspace, cluster = vec(jobs[k])
        ws = workspace_at(workspace)
        ws.step.scalars[0].solve_error = solve_error
        ws.step.scalars[0].touching = touching
        advance_cluster(system_at(system), ws, cluster_state_at(cluster), duration, step,
                        tolerance)
