"""Numbers as people type them: read to the digit, or refused in words.

Taken: 70, 70.5, .5, 1e-3, 3,5 (a comma in a single number), 1 000 and 1'000, 1,234.5 and 1.234,5,
digits of any script, a minus sign of any kind, and a unit behind it. Refused: what may be two
numbers (1,000), what is none, and what a double cannot hold.
"""
from __future__ import annotations

import math
import re
from collections.abc import Sequence

from ...model import errors

UNITS = {'m': {'m': 0, 'cm': -2, 'mm': -3, 'km': 3}, 'kg': {'kg': 0, 'g': -3, 't': 3},
         '°': {'°': 0, 'deg': 0}, 'N': {'N': 0, 'kN': 3}, 's': {'s': 0, 'ms': -3},
         'm/s²': {'m/s²': 0, 'm/s2': 0, 'm/s^2': 0}}
"""For each unit of a field those in which one may type, with their power of ten."""

SIGNS = str.maketrans({'−': '-', '，': ',', '．': '.', '；': ';', '\u00a0': ' ', '\u2009': ' ',  # noqa: RUF001
                       '\u202f': ' ', '\u3000': ' ', '’': "'"})  # noqa: RUF001
"""What keyboards of other scripts and what is copied from print have for plain signs."""

_PLAIN = re.compile(r'([+-]?)(\d+\.?\d*|\.\d+)(?:e([+-]?\d{1,6}))?', re.IGNORECASE)
_GROUPED = re.compile(r"[+-]?\d{1,3}(?:([ ',.])\d{3})(?:\1\d{3})*(?:[.,]\d*)?")
_UNSURE = re.compile(r'[+-]?[1-9]\d{0,2},\d{3}')
_INFINITE = re.compile(r'([+-]?)(?:inf|infinity|∞)', re.IGNORECASE)
_UNIT = re.compile(r'[a-zA-Z°][a-zA-Z/^²2]*$')
_APART = {unit: re.compile(rf'(?<=[\d.])\s+(?=({"|".join(map(re.escape, powers))})(?![a-zA-Z]))')
          for unit, powers in UNITS.items()}
"""Blanks between a number and its unit."""


class NoNumber(errors.WrongForm):
    """A text that is no number in any usual form."""


def number(text: str, unit: str = '', infinite: bool = False) -> float:
    """The number that a text holds, in ``unit``; ``infinite``: whether inf is one.

    Raises WrongForm, without a path, whose `expected` follows on 'must be'.
    """
    plain = _plain(text)
    if not plain:
        raise errors.WrongForm('', text, 'a number, and nothing stands there')
    match = _INFINITE.fullmatch(plain)
    if match and infinite:
        return math.inf if match[1] != '-' else -math.inf
    digits, power = _without_unit(plain, unit)
    if _UNSURE.fullmatch(digits):
        whole = digits.replace(',', '')
        raise errors.WrongForm('', text, f'clear: write {whole}, or {digits.replace(",", ".")}')
    return _read(_ungrouped(digits), power, text, unit)


def numbers(text: str, count: int, unit: str = '') -> tuple[float, ...]:
    """So many numbers, with commas or spaces between them, or semicolons: 1,5; 2; 0,5.

    The unit stands behind each or behind all; errors are those of ``number``.
    """
    found, apart = parts(text, count, unit), ';' in _plain(text)
    try:
        return tuple(number(part, unit) if apart else _read(part, power, text, unit)
                     for part, power in found)
    except NoNumber:
        raise _not_so_many(text, count) from None


def parts(text: str, count: int, unit: str = '') -> list[tuple[str, int]]:
    """Texts of so many numbers, each with the power of ten of the unit behind them all."""
    plain = _plain(text)
    if plain[:1] + plain[-1:] in ('()', '[]'):
        plain = plain[1:-1].strip()
    if ';' in plain:
        found, power = [part.strip() for part in plain.split(';')], 0
    else:
        plain, power = _without_unit(_APART[unit].sub('', plain) if unit in _APART else plain,
                                     unit)
        found = [part for part in re.split(r'\s*,\s*|\s+', plain) if part or ',' in plain]
        found = [own[0] if (own := _without_unit(part, unit))[1] == power else part
                 for part in found]
    if len(found) != count or not plain:
        raise _not_so_many(text, count)
    return [(part, power) for part in found]


def shown(value: float) -> str:
    """A number as a field shows it: seven digits, which are a tenth of a micrometre of a metre."""
    text = f'{value + 0.0:.7g}'
    mantissa, e, power = text.partition('e')
    return f'{mantissa}e{int(power)}' if e else text


def shown_all(values: Sequence[float]) -> str:
    """Numbers as one field shows them."""
    return ', '.join(shown(value) for value in values)


def _not_so_many(text: str, count: int) -> errors.WrongForm:
    example = ', '.join(('0.1', '0.2', '0.3')[:count])
    return errors.WrongForm('', text, f'{count} numbers, such as {example}')


def _plain(text: str) -> str:
    text = text.translate(SIGNS).strip()
    return ''.join(str(int(c)) if c.isdecimal() else c for c in text)


def _without_unit(plain: str, unit: str) -> tuple[str, int]:
    """What stands before a unit, and its power of ten; any other word is left for who reads."""
    match = _UNIT.search(plain)
    powers = UNITS.get(unit, {unit: 0})
    if match and match[0] in powers and plain[:match.start()].strip():
        return plain[:match.start()].rstrip(), powers[match[0]]
    return plain, 0


def _ungrouped(digits: str) -> str:
    """A number with a point alone: what groups thousands is left out, a comma is a point."""
    match = _GROUPED.fullmatch(digits)
    group = match and match[1]
    if group in (' ', "'") or (group and (digits.count(group) > 1 or (',' in digits
                                                                      and '.' in digits))):
        digits = digits.replace(group, '')
    return digits.replace(',', '.') if digits.count(',') == 1 else digits


def _read(digits: str, power: int, text: str, unit: str) -> float:
    match = _PLAIN.fullmatch(digits)
    if match is None:
        example = f'70{" " * (unit != "°") + unit if unit else ""}'
        raise NoNumber('', text, f'a number, such as {example}')
    value = float(f'{match[1]}{match[2]}e{int(match[3] or 0) + power}')
    if math.isinf(value):
        raise errors.WrongForm('', text, 'below 1.8e308')
    if value == 0 and re.search('[1-9]', match[2]):
        raise errors.WrongForm('', text, 'zero, or no smaller than 5e-324')
    return value
