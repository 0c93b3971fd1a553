"""A step where something touches, by Moreau's centred scheme.

Forces, contacts and their rows are those at the middle of the way, so that it is of order 2 where
no contact begins or ends (Moreau 1988; Studer, Numerics of Unilateral Contacts and Friction,
2009). Of the velocities there, half of what contacts change is a part: what they changed in the
step before stands in for it. Joint damping, hands' springs and drives are taken implicitly at the
middle as well. Then depths are given back in position alone, and momentum is kept where the ground
bears nothing.
"""
from __future__ import annotations

import numpy as np

from ..compiling.decorators import compiled
from ..contact.find import find_contacts
from ..contact.gaps import TOUCHING, look, place_geoms
from ..contact.rows import contact_rates
from ..dynamics.bias import bias_forces, integrate, update_moves
from ..dynamics.forward import pose
from ..dynamics.mass import crba, factor, root_axes, solve_lower, solve_upper, turn_inertias
from ..impulses.response import respond
from ..system import STICKS, Course, Room, System
from .forces import lag, pull, root_q, stiffen, weaken
from .give_back import enter_shift, keep_limits, lifted, pay
from .momentum import give_contacts, keep_momentum, sum_dolls
from .warm_start import warm_start
from .work import enter_work, reached

STEP_TOLERANCE = 1e-8
"""m/s to which contacts are solved."""

SLOW = 0.02
"""m/s, and SLOW_TURN rad/s: what meets more slowly where something touches already is taken on
by the next step, without restitution, and not sought out."""

SLOW_TURN = 0.1

DEEP = 5e-4
"""m into the ground or a bone to which a step may press."""

STEADY = 1.0
"""m/s^2 or rad/s^2, over a step: what contacts stop that is faster, they do not stop again."""


@compiled
def begin_step(s: System, r: Room, course: Course, loads: np.ndarray) -> None:
    """Note what touches as a step begins and how it moves, and the sums over the dolls.

    On a curved way the rows at the step's middle see J v as h/2 dJ/dt v where it is zero at the
    start: what they see of v' is to be its opposite, for it to be zero at the end.
    """
    q, v = course.q, course.v
    pose(s.tree, q, v, r.work)
    sum_dolls(s, q, r, r.before)
    r.lift[1] = reached(s, r, q, loads)
    place_geoms(s.tree, s.root_of, s.geoms, r.work, q, r.at, r.turn)
    m = find_contacts(s, q, r, r.gaps, TOUCHING)
    for i in range(m):
        contact_rates(s, r, q, v, r.contacts[i])
        r.begun[i] = r.contacts[i]
    r.count[0] = m


@compiled
def contact_step(s: System, r: Room, course: Course, h: float, loads: np.ndarray,
                 springs: np.ndarray, since: float, end_q: np.ndarray, end_v: np.ndarray) -> int:
    """Go on by h s to ``end_q`` and ``end_v``; the number of contacts. What gives depths back is
    still to come: r.vectors[3], at the cost of r.lift[0] J.

    ``since``: s since the hands of ``springs`` were where these say.
    """
    q, v, middle = course.q, course.v, r.states[0]
    free, change, shift = r.vectors[0], r.vectors[2], r.vectors[3]
    integrate(s.tree, q, v, h / 2, middle)
    pose(s.tree, middle, v, r.work)
    move_freely(s, r, v, h, loads, springs, since + h / 2, course.reaction)
    place_geoms(s.tree, s.root_of, s.geoms, r.work, middle, r.at, r.turn)
    m = find_contacts(s, middle, r, r.met, SLOW * h)
    r.left[0] = 0.0
    if m:
        warm_start(s, r, m, course.known, h)
        respond(s, r, middle, v, free, m, h, STEP_TOLERANCE, change, shift)
        for j in range(len(v)):
            end_v[j] = free[j] + change[j]
    else:
        for j in range(len(v)):
            end_v[j], shift[j] = free[j], 0.0
    lasts = m > 0 and all_last(r, m, h)
    for j in range(len(v)):
        course.reaction[j] = change[j] / h if lasts else 0.0
    integrate(s.tree, middle, end_v, h / 2, end_q)
    keep_limits(s, end_q, shift)
    r.lift[0] = lifted(s, r, shift) if m else 0.0
    r.tally[0].steps += 1
    return m


@compiled
def all_last(r: Room, m: int, h: float) -> bool:
    """Whether all contacts of a step of h s were there before, and neither closed nor opened."""
    for i in range(m):
        c = r.contacts[i]
        if not c.begun or abs(c.start[0]) > STEADY * h:
            return False
        if c.kind > 1 and c.friction >= STICKS and (
                max(abs(c.start[1]), abs(c.start[2])) > STEADY * h):
            return False
    return True


@compiled
def move_freely(s: System, r: Room, v: np.ndarray, h: float, loads: np.ndarray,
                springs: np.ndarray, time: float, reaction: np.ndarray) -> None:
    """Velocities r.vectors[0] into which those at the start, v, come in h s without contacts, and
    the factor of the mass matrix, r.H; work is posed at the middle r.states[0].

    ``reaction`` (nv,): what contacts are taken to accelerate. ``time``: s since the hands were
    where ``springs`` say.
    """
    middle, free, smooth, change = r.states[0], r.vectors[0], r.vectors[1], r.vectors[2]
    root_axes(s.tree, middle, r.work.axes)
    turn_inertias(s.tree, r.work, r.own)
    for k in range(len(springs)):
        springs[k, 14] = 1.0
    for turn in range(2 if len(springs) else 1):
        crba(s.tree, s.up, s.bone_of, r.work, r.own, r.composite, r.H)
        for j in range(len(v)):
            r.H[j, j] += h * lag(h * s.damping[j] / r.H[j, j]) * s.damping[j]
        for k in range(len(springs)):
            stiffen(s.tree, s.up, s.last, r.work, r.H, springs[k], h)
        factor(r.H, s.up)
        for stage in range(2):
            if stage or turn:
                for j in range(len(v)):
                    smooth[j] = v[j] + ((change[j] + h * reaction[j]) / 2 if stage else 0.0)
                update_moves(s.tree, middle, smooth, r.work)
            bias_forces(s.tree, s.gravity, loads, middle, smooth if stage else v, r.work, r.own,
                        change)
            for k in range(len(springs)):
                pull(s.tree, s.up, s.last, r.work, middle, root_q(s, springs[k]), v, springs[k],
                     time, change)
            for j in range(len(v)):
                change[j] = h * (change[j] - s.damping[j] * v[j])
            solve_upper(r.H, s.up, change)
            solve_lower(r.H, s.up, change)
        for j in range(len(v)):
            free[j] = v[j] + change[j]
        if turn or not weaken(s, r, middle, v, free, springs, time, h):
            break


@compiled
def settle(s: System, r: Room, course: Course, h: float, loads: np.ndarray, springs: np.ndarray,
           since: float, m: int, end_q: np.ndarray, end_v: np.ndarray) -> None:
    """Book the work of a step of h s, give depths back by r.vectors[3], keep the momentum of what
    the ground does not bear; then the gaps and the sums at the end.
    """
    free = False
    for d in range(len(r.given)):
        given = r.given[d]
        given.borne = given.meets = 0
        for k in range(3):
            given.impulse[k] = given.moment[k] = 0.0
    give_contacts(s, r, m, r.given)
    if len(loads) or len(springs):
        enter_work(s, r, course.v, end_v, h, loads, springs, since)
    pose(s.tree, end_q, end_v, r.work)
    sum_dolls(s, end_q, r, r.after)
    for d in range(len(r.given)):
        free |= not r.given[d].borne
        for k in range(3):
            r.given[d].centre[k] = r.after[d].centre[k]
    pay(s, r, m, r.vectors[3])
    integrate(s.tree, end_q, r.vectors[3], 1.0, end_q)
    if free:
        pose(s.tree, end_q, end_v, r.work)
        sum_dolls(s, end_q, r, r.after)
        keep_momentum(s, r, h, end_q, end_v)
    enter_shift(s, r, end_q, r.vectors[3])
    look(s, r, end_q, end_v, r.gaps, h, r.later)
    sum_dolls(s, end_q, r, r.after)
    r.tally[0].pushed += reached(s, r, end_q, loads) - r.lift[1]
