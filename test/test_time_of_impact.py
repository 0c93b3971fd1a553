"""The time of impact within a step, where gaps close that are not straight."""
from __future__ import annotations

import collections

import numpy as np
import pytest

pytest.importorskip('numba')

from kept_code import kept

from ragdoll_ros.physics.accuracy import ACCURACIES, TOUCHING
from ragdoll_ros.physics.kernels.stepping.position_correction import (
    clip_to_joint_limits,
)
from ragdoll_ros.physics.kernels.stepping.step_control import (
    MAX_TRIES,
    activate_contacts,
)
from ragdoll_ros.physics.kernels.stepping.time_of_impact import (
    OVERSHOT,
    impacts_at_end,
    next_trial_step,
    open_bracket,
    step_to_joint_limit,
    update_bracket,
)
from ragdoll_ros.physics.kernels.system import JOINT_LIMIT
from ragdoll_ros.physics.kernels.workspace import (
    BRACKET,
    GAP_COUNTS,
    STEP_SCALARS,
)

Scene = collections.namedtuple('Scene', 'pairs joint_limits body_doll dof_body')
Gaps = collections.namedtuple('Gaps', 'gaps contacts step gap_counts')
Contacts = collections.namedtuple('Contacts', 'gaps_end gaps_active')
Step = collections.namedtuple('Step', 'scalars bracket gaps_low gaps_high gaps_middle')


def scene(*bounds):
    """What of a scene limits are: none, or those of coordinates 0, 1, ... of one doll, rad."""
    rows = [(k, k, lower, upper) for k, (lower, upper) in enumerate(bounds)]
    return Scene(np.zeros(0), np.array(rows, JOINT_LIMIT), np.zeros(len(rows), int),
                 np.arange(len(rows)))


def gaps(start, touching=TOUCHING):
    """What of a workspace gaps are."""
    count, scalars = len(start), np.zeros(1, STEP_SCALARS)
    scalars['touching'] = touching
    return Gaps(np.array(start), Contacts(np.zeros(count), np.array(start)),
                Step(scalars, np.zeros(1, BRACKET), np.zeros(count), np.zeros(count),
                     np.zeros(count)),
                np.full(1, count, GAP_COUNTS))


@kept
def _tries(scene, ws, v, length, step, starts, falls, powers):
    """Lengths of a step of ``step`` s tried, this one first, until one ends at the touch. Gap k at
    the end of h s is starts[k] - falls[k] (h / step) ** powers[k], and coordinate k moves by v[k] h
    from its lower limit's gap to its upper one's.
    """
    open_bracket(ws)
    tries = 0
    while tries < 100:
        tries += 1
        ws.contacts.gaps_end[:] = starts - falls * (length / step) ** powers
        for k in range(len(v)):
            ws.contacts.gaps_end[2 * k] += v[k] * length
            ws.contacts.gaps_end[2 * k + 1] -= v[k] * length
        overshot, landed, _ = impacts_at_end(scene, ws, length)
        if not update_bracket(scene, ws, length, overshot, landed):
            break
        if tries == 1:  # the middle is at the velocities of the start, without forces
            ws.step.gaps_middle[:] = starts - falls * (powers == 1) * length / step / 2
            for k in range(len(v)):
                ws.step.gaps_middle[2 * k] += v[k] * length / 2
                ws.step.gaps_middle[2 * k + 1] -= v[k] * length / 2
        length = next_trial_step(ws)
    return tries


@kept
def _step_to_joint_limit(scene, ws, v, step):
    return step_to_joint_limit(scene, ws, v, step)


@kept
def _activate_contacts(scene, ws, h):
    return activate_contacts(scene, ws, h)


@kept
def _clip_to_joint_limits(scene, q, correction):
    clip_to_joint_limits(scene, q, correction)


def tries(starts, falls, powers, step=2e-3, touching=TOUCHING):
    """As many tries as are made, and the least gap at the end."""
    ws, still = gaps(starts, touching), np.zeros(0)
    made = _tries(scene(), ws, still, step, step, np.array(starts), np.array(falls),
                  np.array(powers))
    return made, ws.contacts.gaps_end.min()


def test_two_gaps_that_lag_by_turns_are_brought_to_their_first_touch():
    """A foot that is 2 um above what it meets later, and a hip on its way to its limit: chords went
    from one to the other, 16 of them moved the bracket's end by 3 %, and the hip went .44 degrees
    past its limit.
    """
    made, least = tries([2.06e-6, 9.36e-3], [7.4e-4, 2.24e-2], [5.0, 1.3])
    assert OVERSHOT <= least <= TOUCHING
    assert made < MAX_TRIES


@pytest.mark.parametrize('seed', range(4))
def test_the_first_touch_of_several_gaps_is_met(seed):
    """Straight ones to those that fall with the fourth power, from 2 um to 1 cm high, all of them
    faster than what the next step takes on (SLOW).
    """
    draw = np.random.default_rng(seed)
    worst = 0
    for _ in range(500):
        count = draw.integers(1, 5)
        starts = 10 ** draw.uniform(-5.7, -2, count)
        falls, powers = starts + 10 ** draw.uniform(-4.2, -2, count), draw.uniform(1, 4, count)
        made, least = tries(starts, falls, powers)
        assert OVERSHOT <= least <= TOUCHING, (starts, falls, powers)
        worst = max(worst, made)
    assert worst <= MAX_TRIES


@pytest.mark.parametrize('accuracy', ACCURACIES.values(), ids=ACCURACIES)
def test_a_gap_that_falls_evenly_accelerated_is_met_at_the_second_try(accuracy):
    """A parabola through its start, its rate there and its end is its whole course."""
    draw, step = np.random.default_rng(1), accuracy.step
    for _ in range(200):
        start = draw.uniform(1e-3, 1e-2)  # rad: fast enough to be sought
        rate, fall = draw.uniform(0, 2) * start, draw.uniform(0.1, 2) * start
        ws, limits = gaps([1.0, start], accuracy.touching), scene((-1.0, start))
        made = _tries(limits, ws, np.array([rate / step]), step, step, np.array([1.0, start]),
                      np.array([0.0, start + fall]), np.full(2, 2.0))
        assert made == 2
        assert OVERSHOT <= ws.contacts.gaps_end[1] <= accuracy.touching


def test_a_joint_is_taken_to_its_limit_by_its_rate():
    """What bends its way is past it then, or just before it: two tries, as the way is known to the
    second order where it starts.
    """
    limits, rate = scene((-1.0, 0.01), (-1.0, 1.0)), np.array([4.0, 0.05])
    for bend in (3e-4, -3e-4):  # rad in a step of 2 ms: by 150 rad/s^2
        starts = np.array([1.0, 0.006, 1.0, 1e-5])  # too slow: the second
        ws = gaps(starts)
        step = _step_to_joint_limit(limits, ws, rate, 2e-3)
        assert step == pytest.approx(0.006 / 4)
        made = _tries(limits, ws, rate, step, 2e-3, starts, np.array([0.0, bend, 0.0, 0.0]),
                      np.full(4, 2.0))
        if bend > 0:
            assert made == 2
            assert OVERSHOT <= ws.contacts.gaps_end[1] <= TOUCHING
        else:  # a step like others; the next one begins from there
            assert made == 1
            assert 0 < ws.contacts.gaps_end[1] < 2e-4


def test_what_is_given_back_takes_a_joint_to_its_limit_at_most():
    """So that the step ends there, whichever of its lengths is tried. A step that took the joint
    past it by itself is too long, or began there: that its limit is kept solving sees to.
    """
    limits, shift = scene((-1.0, 1.0), (-1.0, 1.0)), np.array([1e-3, 1e-3])
    for at, left in ((1.0 - 2e-4, 0.2), (1.0 - 2e-9, 2e-6), (1.0 + 2e-9, 1.0)):
        moved = shift.copy()
        _clip_to_joint_limits(limits, np.array([at, 0.0]), moved)
        np.testing.assert_allclose(moved, shift * left, atol=1e-12)
        assert at > 1 or at + moved[0] <= 1 + 1e-15


def test_what_lands_fast_has_met_where_touches_are_not_sought():
    """At its limit as the step ends, on the dot: the step is gone again with the limit, else the
    joint would go on into it. What lands slowly is left to the next step.
    """
    limits, h = scene((-1.0, 1.0)), 2e-3
    for before, met in ((0.01, True), (1e-5, False)):
        ws = gaps([1.0, before])
        ws.contacts.gaps_end[:] = 1.0, 0.0
        assert _activate_contacts(limits, ws, h) == met
        assert (ws.contacts.gaps_active[1] == 0.0) == met
