"""Step control: how long a contact step is, to the time of impact and within bounds on the energy
and the penetrations that it may add.
"""
from __future__ import annotations

import numpy as np

from ..cluster_state import ClusterState
from ..compiling.decorators import compiled
from ..contact.gaps import BEYOND_LIMIT, TOUCHING, is_joint_limit_gap
from ..system import System
from ..workspace import Workspace
from .contact_step import (
    MAX_PENETRATION,
    STEP_TOLERANCE,
    begin_contact_step,
    contact_step,
    finish_step,
)
from .momentum import REMOVABLE, internal_kinetic_energy, remove_energy, total_energy
from .position_correction import PAID_SHARE
from .time_of_impact import (
    OVERSHOT,
    impacts_at_end,
    is_fast_impact,
    next_trial_step,
    open_bracket,
    step_to_joint_limit,
    update_bracket,
)
from .warm_start import jam_threshold

MAX_TRIES = 20
"""Of a step that is to end at an impact and to add no energy."""

FINEST = 0.01
"""Share of the nominal step below which it is not shortened to add no energy; steps that add some
all the same are counted."""

RESTING_GAIN = 1e-6
"""Share of the energy scale that a step may add where the motion can pay for it: near rest, the
energy of a step says little about its error."""

SOLVER_GAIN = 1e-10
"""Share of the energy scale that solving to a tolerance may add in a step."""

KINETIC_GAIN = 1e-4
"""Share of the kinetic energy that a step may add."""

UNSEEN, UNSEEN_EACH, UNSEEN_TURN = 5e-3, 5e-5, 0.05
"""m, at most and for each doll of the cluster, and rad: where times of impact are not sought, steps
are halved, down to the share COARSEST, to keep what meets from penetrating deeper."""

COARSEST = 0.03


@compiled
def step_to_impact(s: System, ws: Workspace, cluster: ClusterState, h: float, since: float,
                   nominal: float, seek: bool) -> tuple[float, bool]:
    """Advance by at most h s, stopping at the first fast impact. Returns the time advanced and
    whether an impact was reached.

    ws.gaps are those at cluster.q before and after. A step that adds much energy, or presses one
    thing deep into another, is too long for what turns: it is repeated at half the length. The
    little energy that others add is removed from the motion. Where impacts are not to be sought,
    what meets in the step is a contact of it, with restitution: it is repeated with that.

    ``nominal``: s of a step where nothing shortens it; ``since``: see contact_step().
    """
    step, stats = ws.step, ws.stats[0]
    length, hit, m = min(h, stats.next_dt) if stats.next_dt > 0 else h, False, 0
    stats.next_dt = 2 * length if 2 * length < nominal else 0.0
    if seek:
        length = step_to_joint_limit(s, ws, cluster.v, length)
    begin_contact_step(s, ws, cluster)
    begin_trials(ws)
    step.scalars[0].seeks_impacts = 1 if seek else 0
    held, moving = total_energy(step.sums_before)
    pushes, grabs, corrections = (stats.work_pushes, stats.work_grabs,
                                  stats.work_position_correction)
    for turn in range(MAX_TRIES):
        stats.work_pushes, stats.work_grabs, stats.work_position_correction = (
            pushes, grabs, corrections)
        m = contact_step(s, ws, cluster, length, since)
        finish_step(s, ws, cluster, length, since, m)
        now, speed = total_energy(step.sums_after)
        work = stats.work_pushes - pushes + stats.work_grabs - grabs
        gained = now - held - work
        tolerated = tolerated_energy_gain(s, ws, m, length, max(moving, speed), work)
        if turn < MAX_TRIES - 1 and length > FINEST * nominal and (
                not gained - step.scalars[0].correction_energy <= tolerated
                or penetrates_further(s, ws)
                or (not seek and length > COARSEST * nominal and penetrates_unseen(s, ws))):
            length, hit = length / 2, False
            stats.next_dt = length
            begin_trials(ws)
            clear_contact_accelerations(cluster)
            continue
        if not seek and turn < MAX_TRIES - 1 and activate_contacts(s, ws, length):
            continue
        overshot, landed, fast = impacts_at_end(s, ws, length)
        hit = seek and fast
        if seek and turn < MAX_TRIES - 1 and update_bracket(s, ws, length, overshot, landed):
            length = next_trial_step(s, ws, cluster.v)
            continue
        gained -= stats.work_position_correction - corrections
        if not gained <= tolerated:
            stats.energy_gains += 1
        if gained > tolerated or 0 < gained < REMOVABLE * internal_kinetic_energy(s, ws):
            remove_energy(s, ws, gained, step.q_end, step.v_end)
        break
    accept_step(ws, cluster, m, length, length > 0.1 * h)
    return length, hit


@compiled
def begin_trials(ws: Workspace) -> None:
    """Begin with the gaps at the start, and with nothing known of a time of impact."""
    copy_into(ws.contacts.gaps_active, ws.gaps)
    open_bracket(ws)


@compiled
def accept_step(ws: Workspace, cluster: ClusterState, m: int, length: float,
                warm: bool) -> None:
    """Let the cluster be at the end of the step. ``warm``: its contacts are known to the next."""
    if warm:
        for i in range(m):
            cluster.contacts[i] = ws.contacts.found[i]
        ws.stats[0].contact_count, ws.stats[0].last_dt = m, length
    copy_into(cluster.q, ws.step.q_end)
    copy_into(cluster.v, ws.step.v_end)
    copy_into(ws.gaps, ws.contacts.gaps_end)


@compiled
def clear_contact_accelerations(cluster: ClusterState) -> None:
    """Let nothing be known of what contacts will do."""
    for j in range(len(cluster.contact_accelerations)):
        cluster.contact_accelerations[j] = 0.0


@compiled
def penetrates_unseen(s: System, ws: Workspace) -> bool:
    """Whether something met in the step just taken that ends deep within the other."""
    deep = min(UNSEEN, UNSEEN_EACH * len(ws.step.external))
    for j in range(len(ws.gaps)):
        most = UNSEEN_TURN if is_joint_limit_gap(s, ws.gaps, j) else deep
        if ws.contacts.gaps_active[j] > TOUCHING and ws.contacts.gaps_end[j] < -most:
            return True
    return False


@compiled
def activate_contacts(s: System, ws: Workspace, h: float) -> bool:
    """Let what met in the step of h s just taken, deep or fast, touch in it. Returns whether there
    is any.
    """
    active, end, some = ws.contacts.gaps_active, ws.contacts.gaps_end, False
    for j in range(len(active)):
        if active[j] > TOUCHING and (end[j] < OVERSHOT or is_fast_impact(s, ws, j, h)):
            active[j] = end[j]
            some = True
    return some


@compiled
def copy_into(to: np.ndarray, values: np.ndarray) -> None:
    """Copy values (k,)."""
    for j in range(len(to)):
        to[j] = values[j]


@compiled
def tolerated_energy_gain(s: System, ws: Workspace, m: int, h: float, kinetic: float,
                          work: float) -> float:
    """Energy gain, J, tolerated in a step of h s with m contacts: a fraction of the kinetic energy,
    or, near rest, of m g L, both as far as the motion can pay for it; and what the tolerances of
    solving add, that of contacts times the sum of all impulses.
    """
    total = 0.0
    for i in range(m):
        for e in range(ws.contacts.found[i].kind):
            total += abs(ws.contacts.found[i].impulse[e])
    share = max(KINETIC_GAIN * (kinetic + abs(work)),
                min(PAID_SHARE * kinetic, RESTING_GAIN * s.energy_scale[0]))
    return min(share, (REMOVABLE - PAID_SHARE) * internal_kinetic_energy(s, ws)) + (
        SOLVER_GAIN * s.energy_scale[0] + max(10 * STEP_TOLERANCE, ws.step.scalars[0].residual)
        * min(total, jam_threshold(s, ws, h)))


@compiled
def penetrates_further(s: System, ws: Workspace) -> bool:
    """Whether something that touched is deep at the step's end, and deeper by a tenth of that than
    at its start.
    """
    for j in range(len(ws.gaps)):
        most = BEYOND_LIMIT if is_joint_limit_gap(s, ws.gaps, j) else MAX_PENETRATION
        end = ws.contacts.gaps_end[j]
        if end < -most and ws.gaps[j] <= TOUCHING and end < ws.gaps[j] - most / 10:
            return True
    return False
