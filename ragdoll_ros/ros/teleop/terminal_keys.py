"""Keyboard input from a terminal.

A terminal repeats a held key after a delay of up to 0.6 s and reports no release; of two held keys
it repeats only the last. Terminals with the kitty keyboard protocol
(sw.kovidgoyal.net/kitty/keyboard-protocol) report releases if enabled.
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
_MAX_SEQUENCE = 64
"""Characters of an unfinished escape sequence that are kept."""


class KeyDecoder:
    """Decodes terminal input into keys: arrows by name, others by their character."""

    def __init__(self) -> None:
        self._rest = ''

    def feed(self, data: bytes) -> list[tuple[str, bool]]:
        """Decode (key, is_down); an escape sequence may be split between calls."""
        text, keys, at = self._rest + data.decode('utf-8', 'replace'), [], 0
        self._rest = ''
        while at < len(text):
            match = _SEQUENCE.match(text, at)
            if match:
                at = match.end()
                if match[2] in _ARROWS:
                    keys.append((_ARROWS[match[2]], not match[1].endswith(':3')))
            elif _UNFINISHED.match(text, at) and len(text) - at < _MAX_SEQUENCE:
                self._rest = text[at:]
                break
            else:
                if text[at] != '\x1b':
                    keys.append((text[at], True))
                at += 1
        return keys


class Keyboard:
    """Context manager: the terminal in cbreak mode without echo."""

    def __init__(self) -> None:
        self._file = sys.stdin.fileno()
        self._decoder = KeyDecoder()

    def __enter__(self) -> Keyboard:
        self._before = termios.tcgetattr(self._file)
        tty.setcbreak(self._file, termios.TCSADRAIN)
        _write('\x1b[>2u')
        return self

    def __exit__(self, *_: object) -> None:
        _write('\x1b[<u')
        termios.tcsetattr(self._file, termios.TCSADRAIN, self._before)

    def keys(self, timeout: float) -> list[tuple[str, bool]]:
        """Wait up to ``timeout`` s for keys (key, is_down); a closed terminal gives q."""
        if not select.select([self._file], [], [], timeout)[0]:
            return []
        try:
            data = os.read(self._file, 1024)
        except OSError:
            data = b''
        return self._decoder.feed(data) if data else [('q', True)]


def _write(text: str) -> None:
    sys.stdout.write(text)
    sys.stdout.flush()
