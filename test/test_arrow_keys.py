"""Which arrows push, for how long, and what a tap does to the doll."""
from __future__ import annotations

import numpy as np
import pytest
from conserved import conserved

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model.push import Push
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.realtime.arrow_keys import (
    DIRECTIONS,
    HOLD_DELAY,
    RELEASE_TIMEOUT,
    REPEAT_DELAY,
    REPEAT_PERIOD,
    REPORT_TIMEOUT,
    TAP,
    HeldKeys,
    PressedKeys,
    total_force,
)

FLIGHT = load_scene('flight')
RATES = (11, 25, 30)
"""Repeats in a second: of a console, of X11, of most desktops."""


def hold(held, key, begin, end, rate, delay=0.5):
    """Press a key as a terminal tells it; the instant of the last repeat."""
    held.on_key(key, True, begin)
    assert held.active(begin + 0.9 * delay) == []
    last, now = begin, begin + delay
    while now < end:
        held.on_key(key, True, now)
        last, now = now, now + 1 / rate
    return last


def test_forces_are_those_of_the_article():
    assert {arrow: total_force([arrow]) for arrow in DIRECTIONS} == {
        'up': (-2000, 0, 1), 'down': (2000, 0, 1), 'right': (0, 2000, 1), 'left': (0, -2000, 1)}
    assert total_force(['up'], 350.0)[0] == -350.0
    assert total_force([]) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize('arrow', DIRECTIONS)
def test_a_tap_gives_about_a_metre_a_second(arrow):
    """2000 N for 25 ms on 55 kg: 0.91 m/s."""
    with Simulation(FLIGHT) as simulation:
        simulation.push(Push('torso', total_force([arrow]), duration=TAP))
        for _ in range(10):
            state = simulation.advance()
        momentum = conserved(FLIGHT, state).momentum
    mass = sum(bone.mass for bone in FLIGHT.bones)
    assert 0.5 < np.linalg.norm(momentum) / mass < 1.2


def test_a_tap_is_short():
    held = HeldKeys()
    held.on_key('up', True, 10.0)
    assert held.active(10.0 + 0.9 * TAP) == ['up']
    assert held.remaining(10.01) == pytest.approx(TAP - 0.01)
    assert held.active(10.0 + 1.1 * TAP) == []


@pytest.mark.parametrize('between', [0.13, 0.25, 0.5, 1.0])
def test_taps_in_a_row_stay_taps(between):
    """Nobody taps ten times a second, and no terminal repeats more slowly."""
    held = HeldKeys()
    for count in range(10):
        begin = 5.0 + count * between
        held.on_key('left', True, begin)
        assert held.active(begin + 0.9 * TAP) == ['left']
        assert held.active(begin + 1.1 * TAP) == []


@pytest.mark.parametrize('rate', RATES)
@pytest.mark.parametrize('delay', [0.25, 0.5, 0.66])
def test_a_held_key_pushes_until_shortly_after_its_last_repeat(rate, delay):
    held = HeldKeys()
    last = hold(held, 'up', 0.0, 2.0, rate, delay)
    for now in np.arange(delay + 1 / rate, last, 0.003):
        assert held.active(now) == ['up']
    assert held.active(last + 0.9 * REPEAT_PERIOD) == ['up']
    assert held.active(last + 1.1 * REPEAT_PERIOD) == []


def test_keys_pressed_together_add_up():
    held = HeldKeys()
    held.on_key('up', True, 0.0)
    held.on_key('right', True, 0.03)
    assert total_force(held.active(0.04)) == (-2000.0, 2000.0, 2.0)
    assert held.active(0.06) == []


def test_taps_after_each_other_do_not_add_up():
    held = HeldKeys()
    held.on_key('up', True, 0.0)
    held.on_key('right', True, 0.3)
    assert held.active(0.31) == ['right']


def test_two_held_keys_add_up_while_the_second_repeats():
    held = HeldKeys()
    last = hold(held, 'up', 0.0, 1.0, 30)
    last = hold(held, 'right', last + 0.02, 3.0, 30)
    assert total_force(held.active(last)) == (-2000.0, 2000.0, 2.0)
    assert held.active(last + 2 * REPEAT_PERIOD) == []


def test_the_opposite_takes_over():
    held = HeldKeys()
    last = hold(held, 'left', 0.0, 1.0, 30)
    held.on_key('right', True, last + 0.02)
    assert held.active(last + 0.03) == ['right']


def test_where_releases_are_told_they_alone_end_a_held_key():
    held = HeldKeys()
    held.on_key('up', True, 0.0)
    held.on_key('up', False, 0.08)
    assert held.active(0.09) == []
    last = hold(held, 'up', 1.0, 2.0, 30)
    assert held.active(last + REPEAT_DELAY) == ['up']
    held.on_key('right', True, last + 0.1)
    held.on_key('right', True, last + 0.6)
    assert sorted(held.active(last + 0.61)) == ['right', 'up']
    held.on_key('up', False, last + 0.7)
    assert held.active(last + 0.71) == ['right']
    held.on_key('right', False, last + 0.8)
    assert held.active(last + 0.8) == []


def test_a_key_whose_release_is_never_told_does_not_push_for_ever():
    held = HeldKeys()
    held.on_key('up', True, 0.0)
    held.on_key('up', False, 0.1)
    last = hold(held, 'up', 1.0, 2.0, 30)
    assert held.active(last + 0.9 * RELEASE_TIMEOUT) == ['up']
    assert held.active(last + 1.1 * RELEASE_TIMEOUT) == []


def pushing(pressed, begin, end, down=(), step=0.002):
    """S for which an arrow pushes in a stretch of time in which ``down`` is told ten times a s."""
    pushed, told = 0.0, begin
    for now in np.arange(begin, end, step):
        if down and now >= told:
            pressed.report(down, now)
            told += 0.1
        pushed += step * bool(pressed.active(now))
    return pushed


@pytest.mark.parametrize('length', [0.01, 0.08, 0.13])
def test_a_key_that_is_tapped_pushes_for_a_tap(length):
    pressed = PressedKeys()
    assert pressed.report(['up'], 7.0) and pressed.active(7.0) == ['up']
    pushed = pushing(pressed, 7.0, 7.0 + length, ['up'])
    assert not pressed.report([], 7.0 + length)
    assert pushed + pushing(pressed, 7.0 + length, 8.0) == pytest.approx(TAP, abs=0.004)


def test_a_key_that_is_held_pushes_until_it_is_let_go():
    """But for the pause in which it might be a tap: 13 % of a second."""
    pressed = PressedKeys()
    pushed = pushing(pressed, 3.0, 4.0, ['left'])
    pressed.report([], 4.0)
    assert pushed == pytest.approx(1.0 - HOLD_DELAY + TAP, abs=0.006) and pushed > 0.85
    assert pressed.active(4.0) == []


def test_keys_that_are_down_together_add_up():
    pressed = PressedKeys()
    pressed.report(['up'], 0.0)
    pressed.report(['up', 'left'], 0.01)
    assert total_force(pressed.active(0.01)) == (-2000.0, -2000.0, 2.0)
    pressed.report(['up', 'left', 'elbow'], 0.2)
    assert pressed.held(0.2) == ['left', 'up']


def test_a_keyboard_of_which_nothing_more_is_heard_lets_go():
    pressed = PressedKeys()
    pressed.report(['up'], 0.0)
    assert pressed.active(REPORT_TIMEOUT - 0.01) == ['up']
    assert pressed.active(REPORT_TIMEOUT + 0.01) == []
