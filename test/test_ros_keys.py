"""What a terminal sends, and which arrows count as held."""
from __future__ import annotations

import pytest

from ragdoll_ros.physics.arrow_keys import FIRST, REPEAT, STUCK, Held
from ragdoll_ros.ros.keys import Decoder
from ragdoll_ros.ros.teleop import FORCES, total

ARROWS = {'up': b'\x1b[A', 'down': b'\x1b[B', 'right': b'\x1b[C', 'left': b'\x1b[D'}


@pytest.mark.parametrize('key', ARROWS)
def test_arrows_of_all_modes(key):
    letter = ARROWS[key][-1:]
    for start in (b'\x1b[', b'\x1bO', b'\x1b[1;2', b'\x1b[1;1:2'):
        assert Decoder().feed(start + letter) == [(key, True)]
    assert Decoder().feed(b'\x1b[1;1:3' + letter) == [(key, False)]


def test_keys_in_a_row_and_in_parts():
    data = b'q\x1b[A r\x1b[1;1:3Bx'
    expected = [('q', True), ('up', True), (' ', True), ('r', True), ('down', False), ('x', True)]
    assert Decoder().feed(data) == expected
    decoder = Decoder()
    assert [key for byte in data for key in decoder.feed(bytes([byte]))] == expected


def test_a_lone_escape_and_rubbish_do_no_harm():
    decoder = Decoder()
    assert decoder.feed(b'\x1b') == []
    assert decoder.feed(b'q') == [('q', True)]
    assert decoder.feed(b'\x1b[15~\xff\x1b[113;1:3u')[-1][0] in '\ufffdu'
    assert ('q', True) in decoder.feed(b'\x1b[' + b'1' * 1000 + b'q') + decoder.feed(b'q')


def test_a_tap_lasts_until_a_terminal_would_repeat():
    held = Held()
    held.take('up', True, 10.0)
    assert held.at(10.0 + FIRST - 0.01) == ['up']
    assert held.at(10.0 + FIRST + 0.01) == []


def test_a_held_key_holds_from_press_to_shortly_after_the_last_repeat():
    held, now = Held(), 0.0
    held.take('up', True, now)
    now = 0.5
    while now < 3.0:
        assert held.at(now) == ['up']
        held.take('up', True, now)
        last, now = now, now + 1 / 30
    assert held.at(last + REPEAT - 0.01) == ['up']
    assert held.at(last + REPEAT + 0.01) == []


def test_two_keys_add_up_while_the_second_repeats():
    held = Held()
    held.take('up', True, 0.0)
    held.take('up', True, 0.5)
    for step in range(60):
        held.take('right', True, 0.55 + (0.5 + step / 30 if step else 0))
    assert total(held.at(3.0)) == (-2000.0, 2000.0, 2.0)
    assert held.at(4.0) == []


def test_the_opposite_takes_over():
    held = Held()
    held.take('left', True, 0.0)
    held.take('right', True, 0.1)
    assert held.at(0.2) == ['right']


def test_where_releases_are_told_they_alone_count():
    held = Held()
    held.take('up', True, 0.0)
    held.take('right', True, 0.1)
    held.take('up', False, 0.2)
    assert held.at(1.0) == ['right']
    held.take('right', False, 1.1)
    assert held.at(1.1) == []
    held.take('up', True, 2.0)
    assert held.at(2.0 + FIRST + REPEAT) == ['up']
    assert held.at(2.0 + STUCK + 0.1) == []


def test_forces_are_those_of_the_article():
    assert FORCES == {'up': (-2000, 0, 1), 'down': (2000, 0, 1), 'right': (0, 2000, 1),
                      'left': (0, -2000, 1)}
    assert total([]) == (0.0, 0.0, 0.0)
