"""Time of impact within a step: lengths of the step are tried until one ends at the impact.

Geoms that are apart when a step begins may meet before it ends. A length at which nothing has met
and one at which something has bracket the time of impact, which is approached by regula falsi with
Anderson and Bjoerck's weights (BIT 13, 1973), and by bisection where that lags, as between two gaps
of which one is not straight. The first trial is the whole step, or ends where a joint would reach
its limit at its present rate. The second ends at the root of a parabola through the gaps at the
start and end of the first, whose slope at the start is by the gaps at step.q_middle. The loop that
tries the lengths is step_control.step_to_impact(); in flight, flight/first_contact.py.
"""
from __future__ import annotations

import math

import numpy as np

from ..compiling.decorators import compiled
from ..contact.gaps import (EXCLUDED, SLOW, SLOW_TURN, first_joint_limit_gap,
                            is_joint_limit_gap)
from ..contact.point_gaps import middle_gap
from ..system import System
from ..workspace import Workspace

OVERSHOT = -1e-7
"""m or rad: a gap that is less at a step's end has closed on the way."""

LANDED, AIM = 1e-6, 2e-7
"""m or rad: the impact of a gap that closes fast is found when OVERSHOT <= gap <= LANDED. Trials
aim at a gap of AIM, so that those a little long or short are within these bounds as well."""

SHORTEST = 1e-9
"""s: no step is made shorter to find an impact."""

MAX_CHORDS = 2
"""Chords that may leave the bracket wider than half, before it is bisected."""


@compiled
def is_fast_impact(s: System, ws: Workspace, j: int, h: float) -> bool:
    """Whether gap j was above scalars.touching as the step of h s just taken began, is not above it
    at the end, and closed at a mean rate above SLOW or SLOW_TURN.
    """
    slow = SLOW_TURN if is_joint_limit_gap(s, ws, j) else SLOW
    end, touching = ws.contacts.gaps_end[j], ws.step.scalars[0].touching
    return ws.gaps[j] > touching and end <= touching and ws.gaps[j] - end > slow * h


@compiled
def impacts_at_end(s: System, ws: Workspace, h: float) -> tuple[bool, bool, bool]:
    """Return three flags of the step of h s just taken: whether a gap is overshot at its end (below
    OVERSHOT), whether one has landed (up to LANDED), whether any is a fast impact. The first two
    count fast impacts, and bracketed gaps (step.gaps_high < 0) that touch at the end. Bracketed
    gaps that are not fast impacts have landed in any case.
    """
    overshot = landed = fast = False
    for j in range(ws.gap_counts[0].live):
        quick, end = is_fast_impact(s, ws, j, h), ws.contacts.gaps_end[j]
        fast |= quick
        if quick or (ws.step.gaps_high[j] < 0 and end <= ws.step.scalars[0].touching):
            landed |= end <= LANDED or not quick
            overshot |= end < OVERSHOT
    return overshot, landed, fast


@compiled
def open_bracket(ws: Workspace) -> None:
    """Reset step.bracket to 0 and infinity, step.gaps_low to ws.gaps less AIM, and step.gaps_high
    to EXCLUDED.
    """
    bracket = ws.step.bracket[0]
    bracket.low, bracket.high, bracket.moved = 0.0, math.inf, 0
    bracket.halved_width, bracket.chords = math.inf, 0
    for j in range(ws.gap_counts[0].live):
        ws.step.gaps_low[j], ws.step.gaps_high[j] = ws.gaps[j] - AIM, EXCLUDED


@compiled
def update_bracket(s: System, ws: Workspace, h: float, overshot: bool, landed: bool) -> bool:
    """Update the bracket of the time of impact with a step of h s, see impacts_at_end(). If a gap
    is ``overshot``, the step becomes the high end. Else it becomes the low end if no gap has
    ``landed``, h is above the low end, and the high end is longer than h by more than SHORTEST.
    Returns whether to try another length: of an overshot step, whether h is above SHORTEST; of
    another, whether it became the low end and there is a high end.

    Gaps are stored less AIM. At the high end only gaps count that are below OVERSHOT and either
    were negative at the high end before or are fast impacts; the others are EXCLUDED. If the same
    end moves twice in a row, the gaps at the other end are scaled by anderson_bjorck_weight().
    """
    bracket, low, high, end = (ws.step.bracket[0], ws.step.gaps_low, ws.step.gaps_high,
                               ws.contacts.gaps_end)
    if overshot:
        for j in range(ws.gap_counts[0].live):
            gap = EXCLUDED
            if end[j] < OVERSHOT and (high[j] < 0 or is_fast_impact(s, ws, j, h)):
                gap = end[j] - AIM
            if bracket.moved > 0:
                low[j] *= anderson_bjorck_weight(high[j], gap)
            high[j] = gap
        bracket.high, bracket.moved = h, 1
        return h > SHORTEST
    if landed or not bracket.high - h > SHORTEST or h <= bracket.low:
        return False
    for j in range(ws.gap_counts[0].live):
        if bracket.moved < 0:
            high[j] *= anderson_bjorck_weight(low[j], end[j] - AIM)
        low[j] = end[j] - AIM
    bracket.low, bracket.moved = h, -1
    return bracket.high < math.inf


@compiled
def anderson_bjorck_weight(before: float, now: float) -> float:
    """Factor of the function's value at the end of the bracket that stays, when the value at the
    other end changes from ``before`` to ``now``: 1 - now/before, or one half where that is not
    positive or the signs differ.
    """
    share = 1 - now / before if before != 0.0 and (now < 0) == (before < 0) else 0.5
    return share if share > 0 else 0.5


@compiled
def update_middle_gaps(s: System, ws: Workspace) -> None:
    """Write to step.gaps_middle the bracketed gaps (gaps_high < 0) at step.q_middle of the trial
    just made, half its length on at the start's velocities. AIM is not subtracted.
    """
    for j in range(ws.gap_counts[0].live):
        if ws.step.gaps_high[j] < 0:
            ws.step.gaps_middle[j] = middle_gap(s, ws, j)


@compiled
def next_trial_step(ws: Workspace) -> float:
    """Next step length to try, s: where the first of the bracketed gaps is AIM, by a parabola
    after the first trial, with step.gaps_middle, then by regula falsi or bisection.
    """
    bracket, high, share = ws.step.bracket[0], ws.step.gaps_high, 1.0
    low, width = bracket.low, bracket.high - bracket.low
    first = bracket.halved_width == math.inf
    bracket.chords += 1
    late = bracket.chords > MAX_CHORDS
    if late or width <= bracket.halved_width / 2:
        bracket.halved_width, bracket.chords = width, 0
    if late:
        return low + width / 2
    for j in range(ws.gap_counts[0].live):
        if high[j] < 0:
            above = max(0.0, ws.step.gaps_low[j])
            if first:
                slope = 2 * (ws.step.gaps_middle[j] - AIM - above)
                share = min(share, parabola_root(above, slope, high[j]))
            else:
                share = min(share, above / (above - high[j]))
    return max(SHORTEST, low + share * width)


@compiled
def parabola_root(start: float, slope: float, end: float) -> float:
    """Zero in 0 to 1 of a parabola with value ``start`` > 0 and this slope at 0, and ``end`` < 0 at
    1.
    """
    bend = end - start - slope
    return 2 * start / (math.sqrt(slope * slope - 4 * bend * start) - slope)


@compiled
def limit_gap_rate(s: System, ws: Workspace, v: np.ndarray, j: int) -> float:
    """Rate, rad/s, at which gap j, the distance of a joint from a limit, grows at velocities v."""
    k = j - first_joint_limit_gap(s, ws)
    rate = v[s.joint_limits[k // 2].dof]
    return -rate if k % 2 else rate


@compiled
def step_to_joint_limit(s: System, ws: Workspace, v: np.ndarray, h: float) -> float:
    """Length of a step, at most h s, at whose end the first joint that approaches a limit fast
    reaches it at its present rate.
    """
    first = first_joint_limit_gap(s, ws)
    for j in range(first, first + 2 * len(s.joint_limits)):
        rate = -limit_gap_rate(s, ws, v, j)
        if rate > SLOW_TURN and ws.gaps[j] > ws.step.scalars[0].touching and (
                ws.gaps[j] < h * rate):
            h = max(SHORTEST, ws.gaps[j] / rate)
    return h
