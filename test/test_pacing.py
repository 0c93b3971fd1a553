"""The pacer against a made-up clock."""
from __future__ import annotations

import random

import pytest

from ragdoll_ros.realtime.pacer import MAX_LAG, Pacer

PERIOD = 10_000_000


def ticks(pacer, calls):
    """Ticks made at each of the calls of a timer, ns."""
    made = []
    for now in calls:
        count = 0
        while pacer.due(now):
            count += 1
        made.append(count)
    return made


def test_a_jittering_timer_makes_one_tick_a_call():
    random.seed(1)
    calls = [k * PERIOD + random.randint(-PERIOD // 3, PERIOD // 3) for k in range(1, 500)]
    assert ticks(Pacer(PERIOD, 0), calls) == [1] * len(calls)


def test_periods_that_are_no_whole_number_do_not_drift():
    pacer = Pacer(1e9 / 60, 0)
    assert sum(ticks(pacer, range(0, 100_000_000_000, 16_000_000))) == pytest.approx(6000, abs=1)


def test_how_early_a_tick_may_be_is_a_share_of_the_period():
    pacer = Pacer(PERIOD, 0)
    assert not pacer.due(PERIOD - 1, 0.0) and not pacer.due(9 * PERIOD // 10 - 1, 0.1)
    assert pacer.due(9 * PERIOD // 10 + 1, 0.1) and pacer.last_due == PERIOD


def test_a_short_stall_is_caught_up():
    pacer = Pacer(PERIOD, 0)
    assert ticks(pacer, [PERIOD, 6 * PERIOD, 7 * PERIOD]) == [1, 5, 1]
    assert pacer.dropped_time == 0


def test_a_long_stall_is_given_up_and_counted():
    pacer = Pacer(PERIOD, 0)
    stall = 10_000_000_000
    assert ticks(pacer, [PERIOD, PERIOD + stall, 2 * PERIOD + stall]) == [1, 1, 1]
    assert pacer.dropped_time == stall - PERIOD


def test_ticks_that_are_too_dear_do_not_pile_up():
    """Each tick takes two periods: what is owed stays within the bound, however long it goes."""
    pacer, now, made = Pacer(PERIOD, 0), PERIOD, 0
    while now < 100_000_000_000:
        assert pacer.due(now)
        now += 2 * PERIOD
        made += 1
    owed = 0
    while pacer.due(now):
        owed += 1
    assert made == pytest.approx(100_000_000_000 / (2 * PERIOD), abs=1)
    assert owed <= MAX_LAG / PERIOD + 1


def test_a_pause_owes_nothing():
    pacer = Pacer(PERIOD, 0)
    pacer.start(500 * PERIOD)
    assert ticks(pacer, [500 * PERIOD, 501 * PERIOD]) == [0, 1]


def test_ticks_that_are_too_dear_are_due_when_their_turn_comes():
    """Late for a second, then each at its own time, and on time as soon as they are cheap again."""
    pacer, now = Pacer(PERIOD, 0), PERIOD
    lags, owed = [], 0.0
    while now < 10_000_000_000:
        assert pacer.due(now)
        lags.append(now - pacer.last_due)
        now += 12 * PERIOD // 10
    assert max(lags) < 200_000_000 and max(lags[len(lags) // 2:]) == 0
    assert pacer.dropped_ticks == pytest.approx(len(lags) * 0.2, rel=0.05)
    lost = pacer.dropped_time
    for _ in range(1000):
        while not pacer.due(now):
            now += PERIOD // 10
        now += PERIOD // 2
        owed = max(owed, now - pacer.last_due)
    assert pacer.dropped_time == pytest.approx(lost, abs=PERIOD) and owed < 2 * PERIOD


def test_a_waiter_that_always_wakes_a_little_late_is_on_time():
    pacer, now, made = Pacer(PERIOD, 0), 0, 0
    while now < 100_000_000_000:
        now += int(pacer.wait(now)) + 100_000
        made += pacer.due(now)
    assert made == pytest.approx(10_000, abs=1) and pacer.dropped_time == 0
