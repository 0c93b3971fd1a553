"""What is in a data set: a page and pictures, beside what is known of real falls."""
from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from ..people.real_falls import DESCENT, IMPACT_SPEEDS, SHARE_THAT_HITS
from . import pictures
from .dataset import DIRECTIONS, Contents, read
from .parts import bones_of
from .simulate import generate

PAGE = 'README.md'
SHEET = 24
"""Falls of the contact sheet."""


def main(arguments: list[str]) -> int:
    """Run `ragdoll_falls describe`; 0."""
    options = parser().parse_args(arguments)
    contents = read(options.folder)
    numbers = np.unique(np.linspace(0, len(contents.hits) - 1, SHEET).round().astype(int))
    falls = list(generate(contents.recipe, numbers.tolist()))
    drawn = pictures.draw_all(contents, falls, options.folder)
    page = options.folder / PAGE
    page.write_text(text(contents, drawn), encoding='utf-8')
    print(f'{page} and {len(drawn)} pictures')
    return 0


def parser() -> argparse.ArgumentParser:
    """Options of `ragdoll_falls describe`."""
    parser = argparse.ArgumentParser(
        'ragdoll_falls describe', description=__doc__, epilog='example: ragdoll_falls describe '
        f'falls; writes falls/{PAGE} and pictures')
    parser.add_argument('folder', type=Path, help='a data set of the format lerobot')
    return parser


def text(contents: Contents, drawn: list[str]) -> str:
    """The page, in Markdown."""
    hits, rests = contents.hits, np.isfinite(contents.durations)
    count, failed = len(hits), len(contents.failures)
    lines = [
        f'# {contents.recipe.name}', '',
        f'{count} falls of {contents.recipe.data["duration"]:g} s at {contents.recipe.rate} Hz, '
        f'simulated at {contents.recipe.data["accuracy"]}; {failed} failed.', '',
        '| | falls |', '| --- | --- |', f'| hit the ground | {hits.mean():.1%} |',
        f'| come to rest | {rests.mean():.1%} |',
        *(f'| fall {name} | {share:.1%} |' for name, share in
          zip(DIRECTIONS, contents.share_towards(), strict=True)), '',
        'Directions are of the centre of mass from the start to the impact, as seen from where the '
        'doll faces at the start; shares are of the falls that hit.', '',
        '## Beside real falls', '', *_beside(contents), '', '## Bones that hit', '',
        '| bone | falls in which it hits | downwards then, m/s |', '| --- | --- | --- |',
        *_bones(contents), '', *(f'![{Path(name).stem}]({name})\n' for name in drawn)]
    if contents.failures:
        lines += ['', '## Failed', '', *(f'- fall {number}: {reason}' for number, reason
                                         in contents.failures.items())]
    return '\n'.join(lines) + '\n'


def _beside(contents: Contents) -> list[str]:
    """Rows of the table beside real falls."""
    rows = ['| | here | real falls | source |', '| --- | --- | --- | --- |',
            f'| onset to impact, s | {_spread(contents.descents[contents.hits])} | '
            f'{DESCENT.mean:.2f} ± {DESCENT.deviation:.2f} | {DESCENT.source} |']
    for part, known in IMPACT_SPEEDS.items():
        names = [contents.bones[index] for index in bones_of(part, contents.bones)]
        if names:
            rows.append(f'| {part} hits with, m/s ({", ".join(names)}) | '
                        f'{_spread(contents.speeds_of(part))} | {known.mean:.2f} ± '
                        f'{known.deviation:.2f} | {known.source} |')
    for part, (share, source) in SHARE_THAT_HITS.items():
        if bones_of(part, contents.bones):
            rows.append(f'| {part} hits in | {contents.share_that_hits(part):.0%} | {share:.0%} | '
                        f'{source} |')
    return rows


def _bones(contents: Contents) -> list[str]:
    known = np.isfinite(contents.impact_speeds)
    return [f'| {name} | {known[:, bone].mean():.0%} | '
            f'{_spread(contents.impact_speeds[known[:, bone], bone])} |'
            for bone, name in enumerate(contents.bones)
            if name not in contents.recipe.data['feet']]


def _spread(values: np.ndarray) -> str:
    return f'{values.mean():.2f} ± {values.std():.2f}' if len(values) else 'none'
