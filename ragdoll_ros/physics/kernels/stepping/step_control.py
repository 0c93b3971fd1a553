"""How long a step is: to the touch that is sought, and until it keeps energy and depths."""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled
from ..contact.gaps import BEYOND, TOUCHING, is_joint_limit_gap
from ..system import ClusterState, Workspace, System
from .position_correction import PAID
from .momentum import SMALL, internal_kinetic_energy, remove_energy, total_energy
from .contact_step import DEEP, STEP_TOLERANCE, begin_contact_step, contact_step, finish_step
from .time_of_impact import SUNK, next_trial_step, is_fast_impact, update_bracket, open_bracket, impact_found, step_to_joint_limit
from .warm_start import jam_threshold

TRIES = 20
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


@compiled
def step_to_impact(s: System, r: Workspace, course: ClusterState, h: float, loads: np.ndarray,
                  springs: np.ndarray, since: float, step: float,
                  seek: bool) -> tuple[float, bool]:
    """Go on by h s, or to the first touch that is fast; the time gone, and whether one was met.

    r.gaps are those at q, and again at the end. A step that makes much energy, or presses one thing
    deep into another, is too long for what turns: it is gone again, half as long. The little energy
    that others make is taken out of the motion. Where touches are not to be sought, what meets in
    the step is held or thrown back in it, as restitution says: it is gone again with that.
    """
    end_q, end_v, tally = r.states[2], r.vectors[4], r.stats[0]
    length, hit, m = min(h, tally.next_dt) if tally.next_dt > 0 else h, False, 0
    tally.next_dt = 2 * length if 2 * length < step else 0.0
    if seek:
        length = step_to_joint_limit(s, r, course.v, length)
    begin_contact_step(s, r, course, loads)
    copy_into(r.gaps_active, r.gaps)
    open_bracket(r)
    r.unsought[0] = 0.0 if seek else 1.0
    held, moving = total_energy(r.sums_before)
    pushed, handed, lifted = tally.work_pushes, tally.work_hands, tally.work_position_correction
    for turn in range(TRIES):
        tally.work_pushes, tally.work_hands, tally.work_position_correction = pushed, handed, lifted
        m = contact_step(s, r, course, length, loads, springs, since, end_q, end_v)
        finish_step(s, r, course, length, loads, springs, since, m, end_q, end_v)
        now, speed = total_energy(r.sums_after)
        work = tally.work_pushes - pushed + tally.work_hands - handed
        gained = now - held - work
        much = tolerated_energy_gain(s, r, m, length, max(moving, speed), work)
        if turn < TRIES - 1 and length > FINEST * step and (
                not gained - r.lift[0] <= much or penetrates_further(s, r)
                or (not seek and length > COARSEST * step and penetrates_unseen(s, r))):
            length, hit = length / 2, False
            tally.next_dt = length
            copy_into(r.gaps_active, r.gaps)
            open_bracket(r)
            clear_contact_accelerations(course)
            continue
        if not seek and turn < TRIES - 1 and activate_contacts(s, r, length):
            continue
        sunk, landed, fast = impact_found(s, r, length)
        hit = seek and fast
        if seek and turn < TRIES - 1 and update_bracket(s, r, length, sunk, landed):
            length = next_trial_step(s, r, course.v)
            continue
        gained -= tally.work_position_correction - lifted
        if not gained <= much:
            tally.energy_gains += 1
        if gained > much or 0 < gained < SMALL * internal_kinetic_energy(s, r):
            remove_energy(s, r, gained, end_q, end_v)
        break
    if length > 0.1 * h:
        for i in range(m):
            course.contacts[i] = r.contacts[i]
        tally.contact_count, tally.last_dt = m, length
    copy_into(course.q, end_q)
    copy_into(course.v, end_v)
    copy_into(r.gaps, r.gaps_end)
    return length, hit


@compiled
def clear_contact_accelerations(course: ClusterState) -> None:
    """Nothing is known of what contacts will do."""
    for j in range(len(course.contact_accelerations)):
        course.contact_accelerations[j] = 0.0


@compiled
def penetrates_unseen(s: System, r: Workspace) -> bool:
    """Whether something met in the step just gone that would end deep within the other."""
    deep = min(MET, MET_EACH * len(r.external))
    for j in range(len(r.gaps)):
        most = MET_TURN if is_joint_limit_gap(s, r.gaps, j) else deep
        if r.gaps_active[j] > TOUCHING and r.gaps_end[j] < -most:
            return True
    return False


@compiled
def activate_contacts(s: System, r: Workspace, h: float) -> bool:
    """Let what met in the step of h s just gone, deep or fast, touch in it; whether any did."""
    some = False
    for j in range(len(r.gaps_active)):
        if r.gaps_active[j] > TOUCHING and (r.gaps_end[j] < SUNK or is_fast_impact(s, r, j, h)):
            r.gaps_active[j] = r.gaps_end[j]
            some = True
    return some


@compiled
def copy_into(to: np.ndarray, values: np.ndarray) -> None:
    """Copy values (k,)."""
    for j in range(len(to)):
        to[j] = values[j]


@compiled
def tolerated_energy_gain(s: System, r: Workspace, m: int, h: float, kinetic: float, work: float) -> float:
    """Energy, J, that a step of h s with m contacts may make: a share of what moves, of what hardly
    moves a share of the heft, both as far as the motion can pay for it, and what the tolerances of
    solving make: that of contacts times the sum of all impulses.
    """
    total = 0.0
    for i in range(m):
        for e in range(r.contacts[i].kind):
            total += abs(r.contacts[i].impulse[e])
    share = max(GAIN * (kinetic + abs(work)), min(PAID * kinetic, SLIGHT * s.energy_scale[0]))
    return min(share, (SMALL - PAID) * internal_kinetic_energy(s, r)) + (
        NOISE * s.energy_scale[0] + max(10 * STEP_TOLERANCE, r.left[0]) * min(total, jam_threshold(s, r, h)))


@compiled
def penetrates_further(s: System, r: Workspace) -> bool:
    """Whether something that touched is deep at the step's end, and deeper by a tenth of that than
    at its start.
    """
    for j in range(len(r.gaps)):
        most = BEYOND if is_joint_limit_gap(s, r.gaps, j) else DEEP
        if r.gaps_end[j] < -most and r.gaps[j] <= TOUCHING and r.gaps_end[j] < r.gaps[j] - most / 10:
            return True
    return False
