"""Parses colours in any usual form; viser takes #1e90ff and rgb(30, 144, 255) only.

It drops other text silently, so pages send what was typed: color_text.js.
"""
from __future__ import annotations

import re
from contextlib import suppress

from ...model import errors
from . import number_parsing

EXPECTED = 'a known colour, such as red, #1e90ff or 30 144 255'

_THREE = re.compile(r'\s*rgb\s*\(([^()]*)\)\s*|([^a-z#]*)', re.IGNORECASE)
_HEX = re.compile(r'\s*#?([0-9a-f]{6})\s*', re.IGNORECASE)


def parse_color(event: str) -> tuple[int, int, int]:
    """Red, green, blue, 0 to 255, of an event of color_text.js; WrongForm, without a path."""
    known, _, text = event.partition(' ')
    if not text.strip():
        raise errors.WrongForm('', text, f'{EXPECTED}, and the field is empty')
    three = _THREE.fullmatch(text)
    numbers = ()
    with suppress(errors.WrongForm):
        numbers = number_parsing.parse_numbers((three[1] or three[2]) if three else '', 3)
    if not all(0 <= number <= 255 and number == round(number) for number in numbers):
        # A browser would clamp 300 to 255.
        raise errors.WrongForm('', text, 'three whole numbers from 0 to 255')
    if numbers:
        return tuple(round(number) for number in numbers)
    match = _HEX.fullmatch(text) or _HEX.fullmatch(known)
    if match is None:
        raise errors.WrongForm('', text, EXPECTED)
    return tuple(bytes.fromhex(match[1]))
