"""A promise and what came out: a row of the page's first table."""
from __future__ import annotations

from collections.abc import Callable, Iterator

from ...physics.accuracy import ACCURACIES
from .figures import Figures, Row


def promise(goal: str, wanted: str, found: str, held: bool) -> Row:
    """The row of one promise."""
    return {'goal': goal, 'wanted': wanted, 'found': found, 'held': held}


def by_setting(figures: Figures, part: str, keep: Callable[[Row], bool] = lambda row: True,
               ) -> Iterator[tuple[str, list[Row]]]:
    """Each of our settings and its rows of a part, where there are any."""
    for accuracy in ACCURACIES:
        rows = [row for row in figures.get(part, ())
                if row.get('method') == f'ours-{accuracy}' and keep(row)]
        if rows:
            yield accuracy, rows
