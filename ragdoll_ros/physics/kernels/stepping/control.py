"""How long a step is: to the touch that is sought, and until it keeps energy and depths."""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled
from ..contact.gaps import BEYOND, TOUCHING, of_limit
from ..system import Course, Room, System
from .give_back import PAID
from .momentum import SMALL, inner_energy, take_out, total_energy
from .step import DEEP, STEP_TOLERANCE, begin_step, contact_step, settle
from .touch import SUNK, between, met_fast, narrow, open_bracket, touched, until_limit
from .warm_start import jammed

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
    if seek:
        length = until_limit(s, r, course.v, length)
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
        if not seek and turn < TRIES - 1 and meet(s, r, length):
            continue
        sunk, landed, fast = touched(s, r, length)
        hit = seek and fast
        if seek and turn < TRIES - 1 and narrow(s, r, length, sunk, landed):
            length = between(s, r, course.v)
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
def meet(s: System, r: Room, h: float) -> bool:
    """Let what met in the step of h s just gone, deep or fast, touch in it; whether any did."""
    some = False
    for j in range(len(r.met)):
        if r.met[j] > TOUCHING and (r.later[j] < SUNK or met_fast(s, r, j, h)):
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
