"""What is wrong, in words for who typed it: no names of classes, no brackets of Python."""
from __future__ import annotations

from ...model import errors
from .number_parsing import shown, shown_all


def sentence(error: errors.ModelError, name: str, unit: str = '') -> str:
    """One sentence on a field called ``name``: what its value must be, and what it is."""
    expected = error.expected.replace('above zero', 'above 0')
    if isinstance(error, (errors.OutOfRange, errors.NotPositive)):
        expected = f'{expected} {unit}'.rstrip()
    value = plain(error.value)
    return f'{name} must be {expected}' + (f', not {value}' if value.strip() else '')


def in_words(error: errors.RagdollError) -> str:
    """An error as lines of text, each with the place that it is about."""
    if isinstance(error, errors.ModelErrors):
        count = f'{len(error.errors)} error{"s" * (len(error.errors) != 1)}'
        return '\n'.join([f'{error.file}: {count}', *(f'  {_line(each)}' for each in error.errors)])
    return _line(error) if isinstance(error, errors.ModelError) else str(error)


def plain(value: object) -> str:
    """A value as people write it, cut where it is long."""
    if isinstance(value, float):
        text = shown(value)
    elif isinstance(value, tuple) and all(isinstance(part, (int, float)) for part in value):
        text = shown_all(value)
    else:
        text = str(value)
    return text if len(text) <= 60 else text[:57] + '...'


def _line(error: errors.ModelError) -> str:
    path = error.path.lstrip('.')
    value = '' if error.value is None else plain(error.value).strip()
    return f'{path}: ' * bool(path) + f'expected {error.expected}' + f', not {value}' * bool(value)
