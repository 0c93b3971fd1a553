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
    FIRST,
    HOLD,
    REPEAT,
    SILENCE,
    STUCK,
    TAP,
    Held,
    Pressed,
    total,
)

FLIGHT = load_scene('flight')
RATES = (11, 25, 30)
"""Repeats in a second: of a console, of X11, of most desktops."""


def hold(held, key, begin, end, rate, delay=0.5):
    """Press a key as a terminal tells it; the instant of the last repeat."""
    held.take(key, True, begin)
    assert held.at(begin + 0.9 * delay) == []
    last, now = begin, begin + delay
    while now < end:
        held.take(key, True, now)
        last, now = now, now + 1 / rate
    return last


def test_forces_are_those_of_the_article():
    assert {arrow: total([arrow]) for arrow in DIRECTIONS} == {
        'up': (-2000, 0, 1), 'down': (2000, 0, 1), 'right': (0, 2000, 1), 'left': (0, -2000, 1)}
    assert total(['up'], 350.0)[0] == -350.0
    assert total([]) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize('arrow', DIRECTIONS)
def test_a_tap_gives_about_a_metre_a_second(arrow):
    """2000 N for 25 ms on 55 kg: 0.91 m/s."""
    with Simulation(FLIGHT) as simulation:
        simulation.push(Push('torso', total([arrow]), duration=TAP))
        for _ in range(10):
            state = simulation.advance()
        momentum = conserved(FLIGHT, state).momentum
    mass = sum(bone.mass for bone in FLIGHT.bones)
    assert 0.5 < np.linalg.norm(momentum) / mass < 1.2


def test_a_tap_is_short():
    held = Held()
    held.take('up', True, 10.0)
    assert held.at(10.0 + 0.9 * TAP) == ['up']
    assert held.left(10.01) == pytest.approx(TAP - 0.01)
    assert held.at(10.0 + 1.1 * TAP) == []


@pytest.mark.parametrize('between', [0.13, 0.25, 0.5, 1.0])
def test_taps_in_a_row_stay_taps(between):
    """Nobody taps ten times a second, and no terminal repeats more slowly."""
    held = Held()
    for count in range(10):
        begin = 5.0 + count * between
        held.take('left', True, begin)
        assert held.at(begin + 0.9 * TAP) == ['left']
        assert held.at(begin + 1.1 * TAP) == []


@pytest.mark.parametrize('rate', RATES)
@pytest.mark.parametrize('delay', [0.25, 0.5, 0.66])
def test_a_held_key_pushes_until_shortly_after_its_last_repeat(rate, delay):
    held = Held()
    last = hold(held, 'up', 0.0, 2.0, rate, delay)
    for now in np.arange(delay + 1 / rate, last, 0.003):
        assert held.at(now) == ['up']
    assert held.at(last + 0.9 * REPEAT) == ['up']
    assert held.at(last + 1.1 * REPEAT) == []


def test_keys_pressed_together_add_up():
    held = Held()
    held.take('up', True, 0.0)
    held.take('right', True, 0.03)
    assert total(held.at(0.04)) == (-2000.0, 2000.0, 2.0)
    assert held.at(0.06) == []


def test_taps_after_each_other_do_not_add_up():
    held = Held()
    held.take('up', True, 0.0)
    held.take('right', True, 0.3)
    assert held.at(0.31) == ['right']


def test_two_held_keys_add_up_while_the_second_repeats():
    held = Held()
    last = hold(held, 'up', 0.0, 1.0, 30)
    last = hold(held, 'right', last + 0.02, 3.0, 30)
    assert total(held.at(last)) == (-2000.0, 2000.0, 2.0)
    assert held.at(last + 2 * REPEAT) == []


def test_the_opposite_takes_over():
    held = Held()
    last = hold(held, 'left', 0.0, 1.0, 30)
    held.take('right', True, last + 0.02)
    assert held.at(last + 0.03) == ['right']


def test_where_releases_are_told_they_alone_end_a_held_key():
    held = Held()
    held.take('up', True, 0.0)
    held.take('up', False, 0.08)
    assert held.at(0.09) == []
    last = hold(held, 'up', 1.0, 2.0, 30)
    assert held.at(last + FIRST) == ['up']
    held.take('right', True, last + 0.1)
    held.take('right', True, last + 0.6)
    assert sorted(held.at(last + 0.61)) == ['right', 'up']
    held.take('up', False, last + 0.7)
    assert held.at(last + 0.71) == ['right']
    held.take('right', False, last + 0.8)
    assert held.at(last + 0.8) == []


def test_a_key_whose_release_is_never_told_does_not_push_for_ever():
    held = Held()
    held.take('up', True, 0.0)
    held.take('up', False, 0.1)
    last = hold(held, 'up', 1.0, 2.0, 30)
    assert held.at(last + 0.9 * STUCK) == ['up']
    assert held.at(last + 1.1 * STUCK) == []


def pushing(pressed, begin, end, down=(), step=0.002):
    """S for which an arrow pushes in a stretch of time in which ``down`` is told ten times a s."""
    pushed, told = 0.0, begin
    for now in np.arange(begin, end, step):
        if down and now >= told:
            pressed.take(down, now)
            told += 0.1
        pushed += step * bool(pressed.at(now))
    return pushed


@pytest.mark.parametrize('length', [0.01, 0.08, 0.13])
def test_a_key_that_is_tapped_pushes_for_a_tap(length):
    pressed = Pressed()
    assert pressed.take(['up'], 7.0) and pressed.at(7.0) == ['up']
    pushed = pushing(pressed, 7.0, 7.0 + length, ['up'])
    assert not pressed.take([], 7.0 + length)
    assert pushed + pushing(pressed, 7.0 + length, 8.0) == pytest.approx(TAP, abs=0.004)


def test_a_key_that_is_held_pushes_until_it_is_let_go():
    """But for the pause in which it might be a tap: 13 % of a second."""
    pressed = Pressed()
    pushed = pushing(pressed, 3.0, 4.0, ['left'])
    pressed.take([], 4.0)
    assert pushed == pytest.approx(1.0 - HOLD + TAP, abs=0.006) and pushed > 0.85
    assert pressed.at(4.0) == []


def test_keys_that_are_down_together_add_up():
    pressed = Pressed()
    pressed.take(['up'], 0.0)
    pressed.take(['up', 'left'], 0.01)
    assert total(pressed.at(0.01)) == (-2000.0, -2000.0, 2.0)
    pressed.take(['up', 'left', 'elbow'], 0.2)
    assert pressed.held(0.2) == ['left', 'up']


def test_a_keyboard_of_which_nothing_more_is_heard_lets_go():
    pressed = Pressed()
    pressed.take(['up'], 0.0)
    assert pressed.at(SILENCE - 0.01) == ['up'] and pressed.at(SILENCE + 0.01) == []
