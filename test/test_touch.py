"""The instant of a touch within a step, where several gaps close that are not straight."""
from __future__ import annotations

import collections

import numpy as np
import pytest

numba = pytest.importorskip('numba')

from ragdoll_ros.physics.kernels.contact.gaps import TOUCHING  # noqa: E402
from ragdoll_ros.physics.kernels.stepping.control import TRIES  # noqa: E402
from ragdoll_ros.physics.kernels.stepping.touch import (  # noqa: E402
    SUNK,
    between,
    narrow,
    open_bracket,
    touched,
)

Scene = collections.namedtuple('Scene', 'pairs bounds')
Gaps = collections.namedtuple('Gaps', 'gaps later above below bracket')
NONE = np.zeros(0)


@numba.njit
def _tries(scene, r, step, starts, falls, powers):
    """Lengths of a step of ``step`` s tried until one ends at the touch, and its gaps at the end:
    gap k is starts[k] - falls[k] (h / step) ** powers[k].
    """
    open_bracket(r)
    r.gaps[:] = starts
    length, tries = step, 0
    while tries < 100:
        tries += 1
        r.later[:] = starts - falls * (length / step) ** powers
        sunk, landed, _ = touched(scene, r, length)
        if not narrow(scene, r, length, sunk, landed):
            break
        length = between(r)
    return tries


def tries(starts, falls, powers, step=2e-3):
    """As many tries as are made, and the least gap at the end."""
    count = len(starts)
    r = Gaps(*(np.zeros(count) for _ in range(4)), np.zeros(5))
    made = _tries(Scene(NONE, NONE), r, step, np.array(starts), np.array(falls), np.array(powers))
    return made, r.later.min()


def test_two_gaps_that_lag_by_turns_are_brought_to_their_first_touch():
    """A foot that is 2 um above what it meets later, and a hip on its way to its limit: chords went
    from one to the other, 16 of them moved the bracket's end by 3 %, and the hip went .44 degrees
    past its limit.
    """
    made, least = tries([2.06e-6, 9.36e-3], [7.4e-4, 2.24e-2], [5.0, 1.3])
    assert SUNK <= least <= TOUCHING
    assert made < TRIES


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
        assert SUNK <= least <= TOUCHING, (starts, falls, powers)
        worst = max(worst, made)
    assert worst <= TRIES
