"""Markdown tables and sections from rows of figures."""
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from .figures import Row, sound

Column = tuple[str, str, str]
"""Key, heading, format: a format text, or 'deg' (from rad), 'mm' (from m), '%', 'us', 'ms'."""

FACTORS = {'deg': (180 / math.pi, '{:.2g}'), 'mm': (1e3, '{:.2g}'), '%': (100.0, '{:.2g}'),
           'us': (1e6, '{:.0f}'), 'ms': (1e3, '{:.3g}')}


def table(rows: Iterable[Row], columns: Sequence[Column]) -> str:
    """Rows as a Markdown table; missing figures are left empty, failed jobs show their error."""
    lines = ['| ' + ' | '.join(head for _, head, _ in columns) + ' |',
             '|' + '|'.join(' --- ' for _ in columns) + '|']
    for row in rows:
        if 'failed' in row:
            lines.append(f'| {row["job"]} | **failed**: {row["failed"]} ({row["at"]}) |')
            continue
        cells = [formatted(row.get(key), form) for key, _, form in columns]
        lines.append('| ' + ' | '.join(cells) + ' |')
    return '\n'.join(lines)


def present(rows: Sequence[Row], columns: Iterable[Column]) -> list[Column]:
    """Columns that some row has a figure for; rows of older versions lack some."""
    return [column for column in columns if any(column[0] in row for row in rows)]


def formatted(value: object, form: str = '{:.2g}') -> str:
    """A figure as text; infinity, also as JSON's text 'inf', stands for a diverged run."""
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


@dataclass(frozen=True)
class Section:
    """A heading with text, tables and pictures, shown if there are rows of ``part``."""

    part: str
    title: str
    """May name the ``{starts}`` of the first row."""
    intro: str = ''
    columns: Sequence[Column] = ()
    """Columns of a table of all rows; empty if there is a ``body``."""
    body: Callable[[list[Row]], list[str]] | None = None
    """Returns the blocks for the rows that did not fail."""
    above: Sequence[tuple[str, str]] = ()
    """Pictures before the rows: name and description."""
    below: Sequence[tuple[str, str]] = ()
    law: Callable[[list[Row]], str] = lambda rows: ''
    """Returns a note on what differs between the methods of the rows."""

    def blocks(self, rows: list[Row], pictures: dict[str, str]) -> list[str]:
        """Markdown blocks, to be separated by empty lines; ``pictures`` are files by names."""
        shown = [[f'![{text}]({pictures[name]})' for name, text in group if name in pictures]
                 for group in (self.above, self.below)]
        title = self.title.format(starts=rows[0].get('starts', ''))
        return [f'## {title}', *filter(None, [self.intro, self.law(rows)]), *shown[0],
                *self.tables(rows), *shown[1]]

    def tables(self, rows: list[Row]) -> list[str]:
        """Blocks of the rows alone, with a table of failed jobs."""
        if self.body is None:
            return [table(rows, self.columns)] if self.columns else []
        good, failed = sound(rows), [row for row in rows if 'failed' in row]
        return [*(self.body(good) if good else ()),
                *([table(failed, (('job', 'failed jobs', '{}'),))] if failed else ())]
