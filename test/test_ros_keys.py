"""What a terminal sends."""
from __future__ import annotations

import pytest

from ragdoll_ros.ros.teleop.terminal_keys import KeyDecoder

ARROWS = {'up': b'\x1b[A', 'down': b'\x1b[B', 'right': b'\x1b[C', 'left': b'\x1b[D'}


@pytest.mark.parametrize('key', ARROWS)
def test_arrows_of_all_modes(key):
    letter = ARROWS[key][-1:]
    for start in (b'\x1b[', b'\x1bO', b'\x1b[1;2', b'\x1b[1;1:2'):
        assert KeyDecoder().feed(start + letter) == [(key, True)]
    assert KeyDecoder().feed(b'\x1b[1;1:3' + letter) == [(key, False)]


def test_keys_in_a_row_and_in_parts():
    data = b'q\x1b[A r\x1b[1;1:3Bx'
    expected = [('q', True), ('up', True), (' ', True), ('r', True), ('down', False), ('x', True)]
    assert KeyDecoder().feed(data) == expected
    decoder = KeyDecoder()
    assert [key for byte in data for key in decoder.feed(bytes([byte]))] == expected


def test_a_lone_escape_and_rubbish_do_no_harm():
    decoder = KeyDecoder()
    assert decoder.feed(b'\x1b') == []
    assert decoder.feed(b'q') == [('q', True)]
    assert decoder.feed(b'\x1b[15~\xff\x1b[113;1:3u')[-1][0] in '\ufffdu'
    assert ('q', True) in decoder.feed(b'\x1b[' + b'1' * 1000 + b'q') + decoder.feed(b'q')
