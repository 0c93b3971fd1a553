"""The instant of a touch within a step: lengths of the step are tried until one ends there.

What is apart when a step begins may meet before it ends; a length at which nothing has met and one
at which something has are drawn together by chords, those of Anderson and Bjoerck (BIT 13, 1973),
and where these lag, as between two gaps of which one is not straight, by halves. A joint's rate is
known: the first length is one after which it is at its limit at that rate, the next is along a
parabola that begins with it.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..contact.gaps import NEVER, TOUCHING, first_joint_limit_gap, is_joint_limit_gap
from ..system import Workspace, System
from .contact_step import SLOW, SLOW_TURN

SUNK = -1e-7
"""m or rad: what is found deeper than this at a step's end has met on the way."""

SHORTEST = 1e-9
"""s: no step is made shorter to find a touch."""

CHORDS = 2
"""Chords that may leave the bracket wider than half, before it is halved."""


@compiled
def is_fast_impact(s: System, r: Workspace, j: int, h: float) -> bool:
    """Whether what gap j parts met in the step of h s just gone, too fast for the next one."""
    slow = SLOW_TURN if is_joint_limit_gap(s, r.gaps, j) else SLOW
    return (r.gaps[j] > TOUCHING and r.gaps_end[j] <= TOUCHING
            and r.gaps[j] - r.gaps_end[j] > slow * h)


@compiled
def impact_found(s: System, r: Workspace, h: float) -> tuple[bool, bool, bool]:
    """Whether something that met fast in the step of h s just gone, or whose touch is sought, is
    SUNK at its end; whether something is there or touches; and whether that came fast.
    """
    sunk = landed = fast = False
    for j in range(len(r.gaps)):
        quick = is_fast_impact(s, r, j, h)
        if quick or (r.below[j] < 0 and r.gaps_end[j] <= TOUCHING):
            fast |= quick
            landed = True
            sunk |= r.gaps_end[j] < SUNK
    return sunk, landed, fast


@compiled
def open_bracket(r: Workspace) -> None:
    """Begin to seek the instant of a touch: all that is known is that it is after the start."""
    r.bracket[0], r.bracket[1], r.bracket[2] = 0.0, math.inf, 0.0
    r.bracket[3], r.bracket[4] = math.inf, 0.0
    for j in range(len(r.gaps)):
        r.above[j], r.below[j] = r.gaps[j], NEVER


@compiled
def update_bracket(s: System, r: Workspace, h: float, sunk: bool, landed: bool) -> bool:
    """Let a step of h s, at the end of which something is ``sunk``, or nothing is, be an end of
    r.bracket; whether the instant of the touch is to be sought between its ends.

    The bracket: lengths, s, at which nothing is sunk, with the gaps r.above, and at which something
    is, r.below; which of them moved last; the width, s, when it was last halved, and the chords
    since. The gaps of the end that stays twice count less: bent().
    """
    ends = r.bracket
    if sunk:
        for j in range(len(r.gaps)):
            low = NEVER
            if r.gaps_end[j] < SUNK and (r.below[j] < 0 or is_fast_impact(s, r, j, h)):
                low = r.gaps_end[j]
            if ends[2] > 0:
                r.above[j] *= anderson_bjorck_weight(r.below[j], low)
            r.below[j] = low
        ends[1], ends[2] = h, 1.0
        return h > SHORTEST
    if landed or not ends[1] - h > SHORTEST or h <= ends[0]:
        return False
    for j in range(len(r.gaps)):
        if ends[2] < 0:
            r.below[j] *= anderson_bjorck_weight(r.above[j], r.gaps_end[j])
        r.above[j] = r.gaps_end[j]
    ends[0], ends[2] = h, -1.0
    return ends[1] < math.inf


@compiled
def anderson_bjorck_weight(before: float, now: float) -> float:
    """By how much the far end of a chord counts less when the near end moves from a value to one
    of the same sign; by half where that says nothing.
    """
    share = 1 - now / before if before != 0.0 and (now < 0) == (before < 0) else 0.5
    return share if share > 0 else 0.5


@compiled
def next_trial_step(s: System, r: Workspace, v: np.ndarray) -> float:
    """Length of a step, s, at the end of which the first of those meets that r.bracket parts; ``v``
    are the velocities at its start.
    """
    ends, share = r.bracket, 1.0
    low, width = ends[0], ends[1] - ends[0]
    straight = ends[3] < math.inf
    ends[4] += 1
    late = ends[4] > CHORDS
    if late or width <= ends[3] / 2:
        ends[3], ends[4] = width, 0.0
    if late:
        return low + width / 2
    for j in range(len(r.gaps)):
        if r.below[j] < 0:
            above = max(0.0, r.above[j])
            if straight or not is_joint_limit_gap(s, r.gaps, j):
                share = min(share, above / (above - r.below[j]))
            else:
                share = min(share, parabola(above, limit_gap_rate(s, r, v, j) * width, r.below[j]))
    return max(SHORTEST, low + share * width)


@compiled
def parabola(above: float, slope: float, below: float) -> float:
    """Where in 0 to 1 a parabola is zero that is ``above`` > 0 at 0, with this slope there, and
    ``below`` < 0 at 1.
    """
    bend = below - above - slope
    return 2 * above / (math.sqrt(slope * slope - 4 * bend * above) - slope)


@compiled
def limit_gap_rate(s: System, r: Workspace, v: np.ndarray, j: int) -> float:
    """Rate, rad/s, at which gap j, a joint's from a limit, opens."""
    k = j - first_joint_limit_gap(s, r.gaps)
    rate = v[s.joint_limits[k // 2].v]
    return -rate if k % 2 else rate


@compiled
def step_to_joint_limit(s: System, r: Workspace, v: np.ndarray, h: float) -> float:
    """Length of a step, at most h s, at the end of which the first joint is at a limit that it
    nears fast, if it goes on at its rate of now.
    """
    first = first_joint_limit_gap(s, r.gaps)
    for j in range(first, first + 2 * len(s.joint_limits)):
        rate = -limit_gap_rate(s, r, v, j)
        if rate > SLOW_TURN and r.gaps[j] > TOUCHING and r.gaps[j] < h * rate:
            h = max(SHORTEST, r.gaps[j] / rate)
    return h
