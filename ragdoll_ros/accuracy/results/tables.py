"""Markdown tables out of rows of figures."""
from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from .figures import Row

Column = tuple[str, str, str]
"""Key, heading, format: a format text, or 'deg' (from rad), 'mm' (from m), '%', 'us', 'ms'."""

FACTORS = {'deg': (180 / math.pi, '{:.2g}'), 'mm': (1e3, '{:.2g}'), '%': (100.0, '{:.2g}'),
           'us': (1e6, '{:.0f}'), 'ms': (1e3, '{:.3g}')}


def table(rows: Iterable[Row], columns: Sequence[Column]) -> str:
    """Rows as a Markdown table; what a row lacks is left empty, a failed job says so."""
    lines = ['| ' + ' | '.join(head for _, head, _ in columns) + ' |',
             '|' + '|'.join(' --- ' for _ in columns) + '|']
    for row in rows:
        if 'failed' in row:
            lines.append(f'| {row["job"]} | **failed**: {row["failed"]} ({row["at"]}) |')
            continue
        cells = [shown(row.get(key), form) for key, _, form in columns]
        lines.append('| ' + ' | '.join(cells) + ' |')
    return '\n'.join(lines)


def shown(value: object, form: str = '{:.2g}') -> str:
    """One figure as text; infinity (also as JSON's text) is what a run that exploded has."""
    if value is None:
        return ''
    if isinstance(value, bool):
        return 'yes' if value else '**no**'
    if isinstance(value, list):
        return ', '.join(map(str, value))
    if isinstance(value, str) and value != 'inf':
        return value
    number = float(value)
    if math.isnan(number):
        return ''
    if math.isinf(number):
        return '∞'
    factor, form = FACTORS.get(form, (1.0, form))
    return form.format(number * factor if factor != 1 else value)
