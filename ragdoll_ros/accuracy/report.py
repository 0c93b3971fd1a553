"""The Markdown page: every figure in it comes from the JSON."""
from __future__ import annotations

from .goals import goals
from .sections import SECTIONS
from .tables import table


def markdown(data: dict, pictures: dict[str, str]) -> str:
    """The page for what the JSON holds; parts without figures are left out.

    ``pictures`` are the files of pictures by their names.
    """
    figures = data['figures']
    blocks = head(data['about'])
    promises = goals(figures)
    if promises:
        blocks += ['## What was promised, what came out', table(promises, (
            ('goal', 'promise', '{}'), ('wanted', 'wanted', '{}'), ('found', 'found', '{}'),
            ('held', 'held', '{}')))]
    for section in SECTIONS:
        if figures.get(section.part):
            blocks += section.blocks(figures[section.part], pictures)
    return '\n\n'.join(blocks) + '\n'


def head(about: dict) -> list[str]:
    """What was run, where, when."""
    versions = ', '.join(f'{name} {version}' for name, version in about['versions'].items())
    return ['# Speed against error', f"""\
Written by `{about['command']}`{' (quick)' if about['quick'] else ''} on {about['date']} in \
{about['seconds']:.0f} s; every figure stands in `accuracy.json`.
Machine: {about['machine']}, {about['cores']} cores, {about['system']}. Python {about['python']}; \
{versions}.
The sums of our ticks are {'compiled by numba' if about.get('compiled') else 'not compiled'}.""",
            """\
CPU times are of the whole tick as Python sees it, reading all poses included: medians, measured \
one after another in one process. Compare ratios, not times. N is the number of substeps in a tick \
of 10 ms."""]
