"""Texts of errors for users of the page: without class names and Python syntax."""
from __future__ import annotations

from ...model import errors
from .number_parsing import format_number, format_numbers


def field_error(error: errors.ModelError, name: str, unit: str = '') -> str:
    """One sentence on a field called ``name``: what its value must be, and what it is."""
    expected = error.expected.replace('above zero', 'above 0')
    if isinstance(error, (errors.OutOfRange, errors.NotPositive)):
        expected = f'{expected} {unit}'.rstrip()
    value = format_value(error.value)
    return f'{name} must be {expected}' + (f', not {value}' if value.strip() else '')


def error_text(error: errors.RagdollError) -> str:
    """An error as lines of text, each with its place."""
    if isinstance(error, errors.ModelErrors):
        count = f'{len(error.errors)} error{"s" * (len(error.errors) != 1)}'
        return '\n'.join([f'{error.file}: {count}', *(f'  {_line(each)}' for each in error.errors)])
    return _line(error) if isinstance(error, errors.ModelError) else str(error)


def format_value(value: object) -> str:
    """A value as it would be typed, at most 60 characters."""
    if isinstance(value, float):
        text = format_number(value)
    elif isinstance(value, tuple) and all(isinstance(part, (int, float)) for part in value):
        text = format_numbers(value)
    else:
        text = str(value)
    return text if len(text) <= 60 else text[:57] + '...'


def _line(error: errors.ModelError) -> str:
    path = error.path.lstrip('.')
    value = '' if error.value is None else format_value(error.value).strip()
    return f'{path}: ' * bool(path) + f'expected {error.expected}' + f', not {value}' * bool(value)
