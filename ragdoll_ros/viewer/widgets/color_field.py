"""The field of a colour: read as people type it; viser takes #1e90ff and rgb(30, 144, 255) alone.

It drops anything else without a word, so pages tell what was typed.
"""
from __future__ import annotations

import re
from contextlib import suppress

from ...model import errors
from . import number_parsing

LEFT = """
    document.addEventListener('focusout', (event) => {
      if (!isTyped(event.target)) return;
      const brush = document.createElement('canvas').getContext('2d');
      brush.fillStyle = 'rgba(0, 0, 0, 0.5)';
      brush.fillStyle = event.target.value;
      const isColor = brush.fillStyle.startsWith('#');
      tell(`${isColor ? brush.fillStyle : '-'} ${event.target.value}`);
    }, true);"""
"""For told.py: what stands in the field when it is left, behind it as #rrggbb where the browser
knows it: a canvas keeps its colour where it does not. First of all who listen, as viser puts its
own text there."""

EXPECTED = 'one that is known, such as red, #1e90ff or 30 144 255'

_THREE = re.compile(r'\s*rgb\s*\(([^()]*)\)\s*|([^a-z#]*)', re.IGNORECASE)
_HEX = re.compile(r'\s*#?([0-9a-f]{6})\s*', re.IGNORECASE)


def color(told: str) -> tuple[int, int, int]:
    """Red, green, blue from 0 to 255 of what a page tells; WrongForm, without a path."""
    known, _, text = told.partition(' ')
    if not text.strip():
        raise errors.WrongForm('', text, f'{EXPECTED}, and nothing stands there')
    three = _THREE.fullmatch(text)
    numbers = ()
    with suppress(errors.WrongForm):
        numbers = number_parsing.numbers((three[1] or three[2]) if three else '', 3)
    if not all(0 <= number <= 255 and number == round(number) for number in numbers):
        # A browser would take 300 for 255.
        raise errors.WrongForm('', text, 'of three whole numbers from 0 to 255')
    if numbers:
        return tuple(round(number) for number in numbers)
    match = _HEX.fullmatch(text) or _HEX.fullmatch(known)
    if match is None:
        raise errors.WrongForm('', text, EXPECTED)
    return tuple(bytes.fromhex(match[1]))
