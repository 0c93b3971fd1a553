"""Keys of a terminal: which come in.

A terminal sends a held key again and again, after a pause of up to 0.6 s, and says nothing when
it is let go; of two held keys it repeats the last one alone. Terminals that know the kitty
keyboard protocol (sw.kovidgoyal.net/kitty/keyboard-protocol) tell releases too, if asked.
"""
from __future__ import annotations

import os
import re
import select
import sys
import termios
import tty

_ARROWS = {'A': 'up', 'B': 'down', 'C': 'right', 'D': 'left'}
_SEQUENCE = re.compile(r'\x1b[\[O]([0-9;:]*)([A-Za-z~])')
_UNFINISHED = re.compile(r'\x1b([\[O][0-9;:]*)?\Z')
_LONGEST = 64
"""Characters of a sequence that are waited for to end."""


class Decoder:
    """Turns what a terminal sends into keys: arrows by name, others by their character."""

    def __init__(self) -> None:
        self._rest = ''

    def feed(self, data: bytes) -> list[tuple[str, bool]]:
        """Keys, each with whether it goes down; a sequence may come in parts."""
        text, keys, at = self._rest + data.decode('utf-8', 'replace'), [], 0
        self._rest = ''
        while at < len(text):
            match = _SEQUENCE.match(text, at)
            if match:
                at = match.end()
                if match[2] in _ARROWS:
                    keys.append((_ARROWS[match[2]], not match[1].endswith(':3')))
            elif _UNFINISHED.match(text, at) and len(text) - at < _LONGEST:
                self._rest = text[at:]
                break
            else:
                if text[at] != '\x1b':
                    keys.append((text[at], True))
                at += 1
        return keys


class Keyboard:
    """The terminal's keys one by one, without echo, until the context ends."""

    def __init__(self) -> None:
        self._file = sys.stdin.fileno()
        self._decoder = Decoder()

    def __enter__(self) -> Keyboard:
        self._before = termios.tcgetattr(self._file)
        tty.setcbreak(self._file, termios.TCSADRAIN)
        _say('\x1b[>2u')
        return self

    def __exit__(self, *_: object) -> None:
        _say('\x1b[<u')
        termios.tcsetattr(self._file, termios.TCSADRAIN, self._before)

    def keys(self, patience: float) -> list[tuple[str, bool]]:
        """Keys that come in within ``patience`` s; a terminal that has gone quits."""
        if not select.select([self._file], [], [], patience)[0]:
            return []
        try:
            data = os.read(self._file, 1024)
        except OSError:
            data = b''
        return self._decoder.feed(data) if data else [('q', True)]


def _say(text: str) -> None:
    sys.stdout.write(text)
    sys.stdout.flush()
