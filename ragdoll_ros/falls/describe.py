"""Describe a data set: a page and pictures, compared with published figures of real falls."""
import argparse
from pathlib import Path

import numpy as np

from ..people.real_falls import DESCENT, IMPACT_SPEEDS, SHARE_THAT_HITS, Known, bones_of
from . import pictures
from .dataset_summary import DIRECTIONS, DatasetSummary, summarize
from .simulate import generate

PAGE = 'README.md'
SHEET = 24
"""Number of falls on the contact sheet."""


def main(arguments: list[str]) -> int:
    """Run `ragdoll_falls describe`; 0."""
    options = parser().parse_args(arguments)
    summary = summarize(options.folder)
    numbers = np.unique(np.linspace(0, len(summary.hits) - 1, SHEET).round().astype(int))
    falls = list(generate(summary.recipe, numbers.tolist()))
    drawn = pictures.draw_all(summary, falls, options.folder)
    page = options.folder / PAGE
    page.write_text(page_text(summary, drawn), encoding='utf-8')
    print(f'{page} and {len(drawn)} pictures')
    return 0


def parser() -> argparse.ArgumentParser:
    """Options of `ragdoll_falls describe`."""
    parser = argparse.ArgumentParser(
        'ragdoll_falls describe', description=__doc__, epilog='example: ragdoll_falls describe '
        f'falls; writes falls/{PAGE} and pictures')
    parser.add_argument('folder', type=Path, help='a data set of the format lerobot')
    return parser


def page_text(summary: DatasetSummary, drawn: list[str]) -> str:
    """The page, in Markdown; ``drawn`` are the paths of its pictures."""
    hits = summary.hits
    count, failed = len(hits), len(summary.failures)
    lines = [
        f'# {summary.recipe.name}', '',
        f'{count} falls of {summary.recipe.data["duration"]:g} s at {summary.recipe.rate} Hz, '
        f'simulated at {summary.recipe.data["accuracy"]}; {failed} failed.', '',
        '| | falls |', '| --- | --- |', f'| hit the ground | {hits.mean():.1%} |',
        f'| come to rest | {len(summary.durations) / count:.1%} |',
        *(f'| fall {name} | {share:.1%} |' for name, share in
          zip(DIRECTIONS, summary.share_towards(), strict=True)), '',
        'A fall hits the ground when a bone other than the feet touches it. Directions are those '
        'of the centre of mass from the start to that instant, relative to the heading at the '
        'start; their shares are of the falls that hit.', '',
        '## Compared with real falls', '', *_comparison(summary), '',
        'The descent lasts from the onset to the impact of the pelvis. Speeds are vertical, of the '
        "bone's centre of mass in the last frame before its first contact; of two hands, the one "
        'that touches first counts.', '', '## Bones that hit', '',
        '| bone | falls in which it hits | speed downwards, m/s |', '| --- | --- | --- |',
        *_bones(summary), '', *_impacts(summary),
        *(f'![{Path(name).stem}]({name})\n' for name in drawn)]
    if summary.failures:
        lines += ['', '## Failed', '', *(f'- fall {number}: {reason}' for number, reason
                                         in summary.failures.items())]
    return '\n'.join(lines) + '\n'


def _comparison(summary: DatasetSummary) -> list[str]:
    """Rows of the table of simulated and real falls; none for body parts that the doll lacks."""
    def row(what: str, part: str, own: np.ndarray, known: Known) -> list[str]:
        names = [summary.bones[index] for index in bones_of(part, summary.bones)]
        return [f'| {what} ({", ".join(names)}) | {_spread(own)} | {known.mean:.2f} ± '
                f'{known.deviation:.2f} | {known.source} |'] if names else []

    rows = ['| | simulated | real falls | source |', '| --- | --- | --- | --- |',
            *row('descent, s', 'pelvis', summary.descents, DESCENT)]
    for part, known in IMPACT_SPEEDS.items():
        rows += row(f'impact speed of the {part}, m/s', part, summary.speeds_of(part), known)
    for part, (share, source) in SHARE_THAT_HITS.items():
        if bones_of(part, summary.bones):
            rows.append(f'| {part} hits in | {summary.share_that_hits(part):.0%} | {share:.0%} | '
                        f'{source} |')
    return rows


def _bones(summary: DatasetSummary) -> list[str]:
    known = np.isfinite(summary.impact_speeds)
    return [f'| {name} | {known[:, bone].mean():.0%} | '
            f'{_spread(summary.impact_speeds[known[:, bone], bone])} |'
            for bone, name in enumerate(summary.bones)
            if name not in summary.recipe.data['feet']]


def _impacts(summary: DatasetSummary) -> list[str]:
    """How hard regions of the body are hit; nothing where the bones have none."""
    if not summary.regions:
        return []
    rows = [f'| {name} | {np.isfinite(ratios).mean():.0%} | {_spread(_known(forces), 0)} | '
            f'{_spread(_known(ratios), 1)} |' for name, forces, ratios in zip(
                summary.regions, summary.peak_forces.T, summary.ratios.T, strict=True)]
    return ['## Impacts', '', '| region | falls in which it hits | peak force, N | ratio to its '
            'limit |', '| --- | --- | --- | --- |', *rows, '',
            f'HIC15 of the head: {_spread(_known(summary.hic15), 0)}.', '',
            'Of each fall the impact that is nearest to the limit. Forces are those of a stated '
            'contact law, limits those of pain from contact with robots (ISO/TS 15066): see '
            'docs/falls.md of ragdoll_ros.', '']


def _known(values: np.ndarray) -> np.ndarray:
    return values[np.isfinite(values)]


def _spread(values: np.ndarray, digits: int = 2) -> str:
    if not len(values):
        return 'none'
    return f'{values.mean():.{digits}f} ± {values.std():.{digits}f}'
