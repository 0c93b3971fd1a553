"""Step control: the length of a contact step, to the time of impact and within bounds on the energy
and the penetrations that it adds.
"""
from __future__ import annotations

import math

import numpy as np

from ..cluster_state import ClusterState
from ..compiling.cycles import cycles
from ..compiling.decorators import compiled
from ..contact.gaps import (BEYOND_LIMIT, SLOW, is_joint_limit_gap,
                            update_kinematics_and_gaps)
from ..contact.point_gaps import has_point_gaps, update_point_gaps
from ..dynamics.kinematics import integrate_positions
from ..system import System
from ..workspace import Workspace
from .contact_step import MAX_PENETRATION, SOLVED_SPEED, contact_step, finish_step
from .impact_log import log_impacts
from .local_error import is_longer, is_too_long, set_smooth_dt
from .momentum import (REMOVABLE, count_contact_impulses, internal_kinetic_energy, remove_energy,
                       total_energy)
from .position_correction import PAID_SHARE
from .time_of_impact import (OVERSHOT, impacts_at_end, is_fast_impact, next_trial_step,
                             open_bracket, step_to_joint_limit, update_bracket, update_middle_gaps)
from .warm_start import jam_threshold

MAX_TRIES = 20
"""Trials of a step that is to end at an impact and to add no energy."""

FINEST = 0.01
"""Share of the nominal step below which it is not shortened to add no energy; steps that add some
all the same are counted."""

RESTING_GAIN = 1e-6
"""Share of the energy scale that a step may add, up to a share of the kinetic energy: near rest,
the energy of a step says little about its error."""

SOLVER_GAIN = 1e-10
"""Share of the energy scale that rounding may add in a step."""

KINETIC_GAIN = 1e-4
"""Share of the kinetic energy that a step may add."""

UNSEEN_SPEED, UNSEEN_TURN = 0.25, 0.05
"""m/s, and rad: where times of impact are not sought, steps are shortened, down to the share
COARSEST, so that what meets in one penetrates by no more than at this speed in a nominal step."""

SAFETY = 0.9
"""Factor on the length of a step that is shortened in proportion."""

COARSEST = 0.03

SPECULATIVE = 1e-3
"""m or rad: where times of impact are not sought, gaps that are narrower as a step begins, as well
as those that would close in twice its length at its velocities, are contacts of it from its first
trial on. Those that do not close in it have no effect."""


@compiled
def step_to_impact(s: System, ws: Workspace, cluster: ClusterState, h: float, since: float,
                   nominal: float, seek: bool) -> tuple[float, bool]:
    """Advance by at most h s after begin_contact_step(); if ``seek``, stop at the first fast
    impact. Returns the time advanced and whether an impact was reached.

    ws.gaps are those at cluster.q before and after. A step that adds much energy or penetration is
    repeated with a shorter length, see shorter_length(). An energy gain that is left, if small or
    above tolerated_energy_gain(), is removed from the motion. Without ``seek``, gaps that close in
    the step become contacts, with restitution, and the step is repeated.

    ``nominal``: nominal length of a step, s; ``since``: see contact_step().
    """
    step, stats, ledger = ws.step, ws.stats[0], ws.stats[0].ledger
    length, hit, m = min(h, stats.next_dt) if stats.next_dt > 0 else h, False, 0
    stats.next_dt = 2 * length if 2 * length < nominal else 0.0
    if seek:
        length = step_to_joint_limit(s, ws, cluster.v, length)
    step.scalars[0].seeks_impacts = 1 if seek else 0
    length = begin_trials(s, ws, cluster, length, nominal)
    held, moving = total_energy(step.sums_before)
    pushes, grabs, corrections = (stats.work_pushes, stats.work_grabs,
                                  stats.work_position_correction)
    for turn in range(MAX_TRIES):
        stats.work_pushes, stats.work_grabs, stats.work_position_correction = (
            pushes, grabs, corrections)
        ledger.trials += 1
        m = contact_step(s, ws, cluster, length, since)
        too_coarse = is_too_long(cluster, step.v_end, length, nominal)
        start_cycles = cycles()
        finish_step(s, ws, cluster, length, since, m)
        ledger.finish_cycles += cycles() - start_cycles
        too_coarse |= is_longer(length, nominal) and any_closed(ws)
        now, speed = total_energy(step.sums_after)
        work = stats.work_pushes - pushes + stats.work_grabs - grabs
        gained = now - held - work
        allowed = tolerated_energy_gain(s, ws, max(moving, speed), work)
        tolerated = allowed + solver_energy(s, ws, m, length)
        may_repeat, shorter = turn < MAX_TRIES - 1, 0.0
        if may_repeat:
            gains = not gained - step.scalars[0].correction_energy <= tolerated
            shorter = shorter_length(s, ws, length, nominal, too_coarse, gains)
        if shorter > 0:
            length = begin_trials(s, ws, cluster, shorter, nominal)
            clear_contact_accelerations(cluster)
            if not too_coarse:
                stats.next_dt = length
            continue
        if not seek and may_repeat and activate_contacts(s, ws, length):
            ledger.new_contacts += 1
            keep_tried(ws, m)
            continue
        overshot, landed, fast = impacts_at_end(s, ws, length)
        hit = seek and fast
        if seek and may_repeat and update_bracket(s, ws, length, overshot, landed):
            if step.bracket[0].halved_width == math.inf:
                update_middle_gaps(s, ws)
            length = next_trial_step(ws)
            ledger.past_impact += 1
            continue
        gained -= stats.work_position_correction - corrections
        if not gained <= tolerated:
            stats.energy_gains += 1
        if gained > allowed or 0 < gained < REMOVABLE * internal_kinetic_energy(s, ws):
            removed = remove_energy(s, ws, gained, step.q_end, step.v_end)
            stats.energy_removed += removed
            stats.energy_unremoved += gained - removed
        break
    count_contact_impulses(s, ws, m, cluster.contact_impulses)
    set_smooth_dt(cluster, step.v_end, length, nominal)
    accept_step(ws, cluster, m, length, length > 0.1 * h)
    if not seek and len(cluster.impact_log):
        log_impacts(s, ws, cluster, m, True, SLOW, since)
    return length, hit


@compiled
def shorter_length(s: System, ws: Workspace, length: float, nominal: float, too_coarse: bool,
                   gains: bool) -> float:
    """Length, s, at which the step of ``length`` s just taken is to be repeated; 0 to accept it.

    If the step is ``too_coarse``: ``nominal``. Else, if it ``gains`` energy or penetrates further,
    and is longer than FINEST nominal: half of ``length``. Else, where impacts are not sought and it
    is longer than COARSEST nominal: ``length`` times unseen_share(), if that is below 1, but at
    least COARSEST nominal. Counts the reason in stats.ledger.
    """
    ledger = ws.stats[0].ledger
    if too_coarse:
        ledger.too_coarse += 1
        return nominal
    if length > FINEST * nominal:
        if gains:
            ledger.too_much_energy += 1
            return length / 2
        if penetrates_further(s, ws):
            ledger.too_deep += 1
            return length / 2
    if not ws.step.scalars[0].seeks_impacts and length > COARSEST * nominal:
        share = unseen_share(s, ws, UNSEEN_SPEED * nominal)
        if share < 1:
            ledger.closed_unseen += 1
            return max(share * length, COARSEST * nominal)
    return 0.0


@compiled
def begin_trials(s: System, ws: Workspace, cluster: ClusterState, h: float,
                 nominal: float) -> float:
    """Copy ws.gaps to contacts.gaps_active and reset the bracket of the time of impact. Returns the
    length of the first trial, at most h s. Where impacts are not sought, it is limited by
    predict_gaps(), and gaps that are below SPECULATIVE or would close within twice that length
    become contacts in gaps_active.
    """
    copy_into(ws.contacts.gaps_active, ws.gaps)
    open_bracket(ws)
    ws.step.scalars[0].tried_count = 0
    if ws.step.scalars[0].seeks_impacts:
        return h
    share = predict_gaps(s, ws, cluster, h, nominal)
    if share < 1 and h > COARSEST * nominal:
        h = max(share * h, COARSEST * nominal)
        predict_gaps(s, ws, cluster, h, nominal)
    touching = ws.step.scalars[0].touching
    for j in range(ws.gap_counts[0].live):
        if ws.contacts.gaps_end[j] < ws.gaps[j] - ws.contacts.gaps_end[j] or (
                ws.gaps[j] < SPECULATIVE):
            ws.contacts.gaps_active[j] = min(touching, ws.gaps[j], ws.contacts.gaps_end[j])
    return h


@compiled
def predict_gaps(s: System, ws: Workspace, cluster: ClusterState, h: float,
                 nominal: float) -> float:
    """Write the gaps after h s at the velocities of the start to contacts.gaps_end. Returns the
    share of h after which none is too deep, by unseen_share(). Overwrites step.q_end and
    step.end.
    """
    step, q, v = ws.step, cluster.q, cluster.v
    integrate_positions(s.tree, q, v, h, step.q_end)
    update_kinematics_and_gaps(s, ws, step.end, step.q_end, v, ws.gaps, h, ws.contacts.gaps_end)
    update_point_gaps(s, ws, step.end, h, ws.contacts.gaps_end)
    return unseen_share(s, ws, UNSEEN_SPEED * nominal)


@compiled
def accept_step(ws: Workspace, cluster: ClusterState, m: int, length: float,
                warm: bool) -> None:
    """Copy the step's end to the cluster and its gaps to ws.gaps; contact points are no longer
    tracked. If ``warm``, keep the m contacts in the cluster, and m and ``length``, s, in ws.stats,
    for the warm start of the next step.
    """
    if warm:
        for i in range(m):
            cluster.contacts[i] = ws.contacts.found[i]
        ws.stats[0].contact_count, ws.stats[0].last_dt = m, length
    copy_into(cluster.q, ws.step.q_end)
    copy_into(cluster.v, ws.step.v_end)
    copy_into(ws.gaps, ws.contacts.gaps_end)
    ws.step.scalars[0].tracks_points = 0


@compiled
def clear_contact_accelerations(cluster: ClusterState) -> None:
    """Set cluster.contact_accelerations to zero."""
    for j in range(len(cluster.contact_accelerations)):
        cluster.contact_accelerations[j] = 0.0


@compiled
def unseen_share(s: System, ws: Workspace, max_depth: float) -> float:
    """Share of the step just taken, times SAFETY, after which no gap is deeper than ``max_depth``,
    m, or UNSEEN_TURN, if all close evenly; 1 if none is deeper at the step's end. Only gaps count
    that are open by contacts.gaps_active: contacts of the step are excluded.
    """
    share, touching = 1.0, ws.step.scalars[0].touching
    for j in range(ws.gap_counts[0].live):
        most = UNSEEN_TURN if is_joint_limit_gap(s, ws, j) else max_depth
        start, end = ws.contacts.gaps_active[j], ws.contacts.gaps_end[j]
        if start > touching and end < -most:
            share = min(share, SAFETY * (start + most) / (start - end))
    return share


@compiled
def activate_contacts(s: System, ws: Workspace, h: float) -> bool:
    """If an open gap is overshot at the end of the step of h s just taken, or is a fast impact,
    make more gaps contacts in contacts.gaps_active, for the repetition of the step: all open gaps
    that would close within 2 h at their mean rates, as the impulses of the first ones will close
    some others. Returns whether a gap is overshot or a fast impact.
    """
    active, end, some = ws.contacts.gaps_active, ws.contacts.gaps_end, False
    touching = ws.step.scalars[0].touching
    for j in range(ws.gap_counts[0].live):
        if active[j] > touching and (end[j] < OVERSHOT or is_fast_impact(s, ws, j, h)):
            some = True
    if some:
        for j in range(ws.gap_counts[0].live):
            if active[j] > touching and end[j] < ws.gaps[j] - end[j]:
                active[j] = min(end[j], touching)
    return some


@compiled
def keep_tried(ws: Workspace, m: int) -> None:
    """Keep the m contacts of a trial, to begin the next one of the same length with their
    impulses: islands without a new contact are solved already.
    """
    for i in range(m):
        ws.contacts.tried[i] = ws.contacts.found[i]
    ws.step.scalars[0].tried_count = m


@compiled
def copy_into(to: np.ndarray, values: np.ndarray) -> None:
    """Copy ``values`` (k,) to ``to``."""
    for j in range(len(to)):
        to[j] = values[j]


@compiled
def tolerated_energy_gain(s: System, ws: Workspace, kinetic: float, work: float) -> float:
    """Energy gain, J, tolerated in a step: a fraction of the ``kinetic`` energy plus the size of
    the ``work`` done; or, if that is more, a fraction of m g L, which counts up to PAID_SHARE of
    the kinetic energy. At most a share of the internal kinetic energy. A fraction of m g L for
    rounding, SOLVER_GAIN, is added to that.
    """
    share = max(KINETIC_GAIN * (kinetic + abs(work)),
                min(PAID_SHARE * kinetic, RESTING_GAIN * s.energy_scale[0]))
    return min(share, (REMOVABLE - PAID_SHARE) * internal_kinetic_energy(s, ws)) + (
        SOLVER_GAIN * s.energy_scale[0])


@compiled
def solver_energy(s: System, ws: Workspace, m: int, h: float) -> float:
    """Energy, J, that the residual of the contact solve may add in a step of h s with m contacts,
    which no shorter step would avoid: the residual, at least ten times the tolerance of the solve,
    times the sum of all impulses, at most jam_threshold().
    """
    total = 0.0
    for i in range(m):
        for e in range(ws.contacts.found[i].kind):
            total += abs(ws.contacts.found[i].impulse[e])
    scalars = ws.step.scalars[0]
    return max(10 * SOLVED_SPEED * scalars.solve_error, scalars.residual) * min(
        total, jam_threshold(s, ws, h))


@compiled
def any_closed(ws: Workspace) -> bool:
    """Whether a gap that was above scalars.touching as the step just taken began is below OVERSHOT
    at its end.
    """
    touching = ws.step.scalars[0].touching
    for j in range(ws.gap_counts[0].live):
        if ws.gaps[j] > touching and ws.contacts.gaps_end[j] < OVERSHOT:
            return True
    return False


@compiled
def penetrates_further(s: System, ws: Workspace) -> bool:
    """Whether a contact of the step, also a speculative one, ends deeper than MAX_PENETRATION or
    BEYOND_LIMIT, and by a tenth of it deeper than at the start.
    """
    touching = ws.step.scalars[0].touching
    for j in range(ws.gap_counts[0].live):
        most = BEYOND_LIMIT if is_joint_limit_gap(s, ws, j) else MAX_PENETRATION
        end = ws.contacts.gaps_end[j]
        if end < -most and ws.contacts.gaps_active[j] <= touching and (
                end < ws.gaps[j] - most / 10) and not has_point_gaps(s, ws, j):
            return True
    return False

