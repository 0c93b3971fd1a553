"""Parses numbers and colours as people type them, or refuses them with a reason.

Numbers are not rounded. Accepted: 70, 70.5, .5, 1e-3, 3,5 (a comma in a single number), 1 000 and
1'000, 1,234.5 and 1.234,5, digits of any script, the minus sign of ASCII or Unicode (U+2212), and a
unit. Refused: ambiguous numbers (1,000), other text, and what a double cannot represent.
"""
from __future__ import annotations

import math
import re
from collections.abc import Sequence
from contextlib import suppress

from ...model import errors

UNITS = {'m': {'m': 0, 'cm': -2, 'mm': -3, 'km': 3}, 'kg': {'kg': 0, 'g': -3, 't': 3},
         '°': {'°': 0, 'deg': 0}, 'N': {'N': 0, 'kN': 3}, 's': {'s': 0, 'ms': -3},
         'm/s²': {'m/s²': 0, 'm/s2': 0, 'm/s^2': 0}}
"""For the unit of a field the accepted units, with their powers of ten."""

SIGNS = str.maketrans({'−': '-', '，': ',', '．': '.', '；': ';', '\u00a0': ' ', '\u2009': ' ',  # noqa: RUF001
                       '\u202f': ' ', '\u3000': ' ', '’': "'"})  # noqa: RUF001
"""Typographic and full-width signs, and their ASCII equivalents."""

_PLAIN = re.compile(r'([+-]?)(\d+\.?\d*|\.\d+)(?:e([+-]?\d{1,6}))?', re.IGNORECASE)
_GROUPED = re.compile(r"[+-]?\d{1,3}(?:([ ',.])\d{3})(?:\1\d{3})*(?:[.,]\d*)?")
_AMBIGUOUS = re.compile(r'[+-]?[1-9]\d{0,2},\d{3}')
_INFINITE = re.compile(r'([+-]?)(?:inf|infinity|∞)', re.IGNORECASE)
_UNIT = re.compile(r'[a-zA-Z°][a-zA-Z/^²2]*$')
_UNIT_SPACES = {
    unit: re.compile(rf'(?<=[\d.])\s+(?=({"|".join(map(re.escape, powers))})(?![a-zA-Z]))')
    for unit, powers in UNITS.items()}
"""Matches spaces between a number and its unit."""

ROUNDING = 1e-15
"""Largest number that is shown as 0: the sine of half a turn is 1.2e-16 in floating point."""

EXPECTED_COLOR = 'a known colour, such as red, #1e90ff or 30 144 255'

_THREE = re.compile(r'\s*rgb\s*\(([^()]*)\)\s*|([^a-z#]*)', re.IGNORECASE)
_HEX = re.compile(r'\s*#?([0-9a-f]{6})\s*', re.IGNORECASE)


class NotANumber(errors.WrongForm):
    """Text that is no number in any accepted form."""


def parse_number(text: str, unit: str = '', infinite: bool = False) -> float:
    """The number in a text, in ``unit``; ``infinite``: whether inf is accepted.

    Raises WrongForm without a path, whose `expected` completes a sentence with 'must be'.
    """
    plain = _normalized(text)
    if not plain:
        raise errors.WrongForm('', text, 'a number, and the field is empty')
    match = _INFINITE.fullmatch(plain)
    if match and infinite:
        return math.inf if match[1] != '-' else -math.inf
    digits, power = _split_unit(plain, unit)
    if _AMBIGUOUS.fullmatch(digits):
        whole, decimal = digits.replace(',', ''), digits.replace(',', '.')
        raise errors.WrongForm('', text, f'unambiguous: write {whole}, or {decimal}')
    return _to_float(_without_grouping(digits), power, text, unit)


def parse_numbers(text: str, count: int, unit: str = '') -> tuple[float, ...]:
    """``count`` numbers, separated by commas, spaces, or semicolons: 1,5; 2; 0,5.

    A unit that only the last one has is that of all; raises the errors of ``parse_number``.
    """
    found, by_semicolon = split_numbers(text, count, unit), ';' in _normalized(text)
    try:
        return tuple(
            parse_number(part, unit) if by_semicolon else _to_float(part, power, text, unit)
            for part, power in found)
    except NotANumber:
        raise _wrong_count(text, count) from None


def split_numbers(text: str, count: int, unit: str = '') -> list[tuple[str, int]]:
    """Texts of ``count`` numbers, each with the power of ten of the unit that they share.

    Between semicolons each text keeps its own unit, and the power is 0.
    """
    plain = _normalized(text)
    if plain[:1] + plain[-1:] in ('()', '[]'):
        plain = plain[1:-1].strip()
    if ';' in plain:
        found, power = [part.strip() for part in plain.split(';')], 0
        *before, own = (part[len(_split_unit(part, unit)[0]):] for part in found)
        if own and not any(before):
            found = [part + own for part in found[:-1]] + found[-1:]
    else:
        if unit in _UNIT_SPACES:
            plain = _UNIT_SPACES[unit].sub('', plain)
        plain, power = _split_unit(plain, unit)
        found = [part for part in re.split(r'\s*,\s*|\s+', plain) if part or ',' in plain]
        found = [own[0] if (own := _split_unit(part, unit))[1] == power else part for part in found]
    if len(found) != count or not plain:
        raise _wrong_count(text, count)
    return [(part, power) for part in found]


def parse_color(event: str) -> tuple[int, int, int]:
    """Red, green, blue, 0 to 255, of an event of color_text.js; WrongForm, without a path.

    Viser takes #1e90ff and rgb(30, 144, 255) only, and drops other text silently.
    """
    known, _, text = event.partition(' ')
    if not text.strip():
        raise errors.WrongForm('', text, f'{EXPECTED_COLOR}, and the field is empty')
    three = _THREE.fullmatch(text)
    numbers = ()
    with suppress(errors.WrongForm):
        numbers = parse_numbers((three[1] or three[2]) if three else '', 3)
    if not all(0 <= number <= 255 and number == round(number) for number in numbers):
        # A browser would clamp 300 to 255.
        raise errors.WrongForm('', text, 'three whole numbers from 0 to 255')
    if numbers:
        return tuple(round(number) for number in numbers)
    match = _HEX.fullmatch(text) or _HEX.fullmatch(known)
    if match is None:
        raise errors.WrongForm('', text, EXPECTED_COLOR)
    return tuple(bytes.fromhex(match[1]))


def two_digits(number: float) -> str:
    """A positive number with two significant digits, from 99.5 on as a whole number.

    Without an exponent above 1e-4.
    """
    return f'{number:.0f}' if number >= 99.5 else f'{number:.2g}'


def format_number(value: float) -> str:
    """A number with seven digits, so a length in m to 0.1 um; 0 for what is only rounding."""
    value = 0.0 if abs(value) < ROUNDING else value
    text = f'{value + 0.0:.7g}'
    mantissa, e, power = text.partition('e')
    return f'{mantissa}e{int(power)}' if e else text


def format_numbers(values: Sequence[float]) -> str:
    """Numbers separated by commas."""
    return ', '.join(format_number(value) for value in values)


def _wrong_count(text: str, count: int) -> errors.WrongForm:
    example = ', '.join(('0.1', '0.2', '0.3')[:count])
    return errors.WrongForm('', text, f'{count} numbers, such as {example}')


def _normalized(text: str) -> str:
    text = text.translate(SIGNS).strip()
    return ''.join(str(int(c)) if c.isdecimal() else c for c in text)


def _split_unit(plain: str, unit: str) -> tuple[str, int]:
    """Text before a unit, and the unit's power of ten; the whole text and 0 without a unit."""
    match = _UNIT.search(plain)
    powers = UNITS.get(unit, {unit: 0})
    if match and match[0] in powers and plain[:match.start()].strip():
        return plain[:match.start()].rstrip(), powers[match[0]]
    return plain, 0


def _without_grouping(digits: str) -> str:
    """A number without separators of thousands and with a decimal point."""
    match = _GROUPED.fullmatch(digits)
    group = match and match[1]
    if group in (' ', "'") or (group and (digits.count(group) > 1 or (',' in digits
                                                                      and '.' in digits))):
        digits = digits.replace(group, '')
    return digits.replace(',', '.') if digits.count(',') == 1 else digits


def _to_float(digits: str, power: int, text: str, unit: str) -> float:
    match = _PLAIN.fullmatch(digits)
    if match is None:
        example = f'70{" " * (unit != "°") + unit if unit else ""}'
        raise NotANumber('', text, f'a number, such as {example}')
    value = float(f'{match[1]}{match[2]}e{int(match[3] or 0) + power}')
    if math.isinf(value):
        raise errors.WrongForm('', text, 'below 1.8e308')
    if value == 0 and re.search('[1-9]', match[2]):
        raise errors.WrongForm('', text, 'zero, or no smaller than 5e-324')
    return value
