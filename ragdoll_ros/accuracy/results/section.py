"""A heading of the Markdown page, with the rows, tables and pictures under it."""
from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from .figures import Row, sound
from .tables import Column, table


@dataclass(frozen=True)
class Section:
    """A heading, with what stands under it where there are rows of ``part``."""

    part: str
    title: str
    """May name the ``{starts}`` of the first row."""
    intro: str = ''
    columns: Sequence[Column] = ()
    """Of the rows as they are; none where ``body`` writes them otherwise."""
    body: Callable[[list[Row]], list[str]] | None = None
    """What stands for the rows that did not fail."""
    above: Sequence[tuple[str, str]] = ()
    """Pictures before the rows: name and description."""
    below: Sequence[tuple[str, str]] = ()

    def blocks(self, rows: list[Row], pictures: dict[str, str]) -> list[str]:
        """Markdown blocks, which empty lines part; ``pictures`` are files by names."""
        shown = [[f'![{text}]({pictures[name]})' for name, text in group if name in pictures]
                 for group in (self.above, self.below)]
        title = self.title.format(starts=rows[0].get('starts', ''))
        return [f'## {title}', *filter(None, [self.intro]), *shown[0], *self.tables(rows),
                *shown[1]]

    def tables(self, rows: list[Row]) -> list[str]:
        """The blocks of the rows alone; jobs that failed say so."""
        if self.body is None:
            return [table(rows, self.columns)] if self.columns else []
        good, failed = sound(rows), [row for row in rows if 'failed' in row]
        return [*(self.body(good) if good else ()),
                *([table(failed, (('job', 'failed jobs', '{}'),))] if failed else ())]
