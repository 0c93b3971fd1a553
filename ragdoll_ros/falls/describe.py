"""Describe a data set by a page and pictures, compared with published figures of real falls."""
import argparse
import sys
from pathlib import Path

import numpy as np

from ..people.real_falls import SHARE_TOLERANCE
from . import pictures
from .comparison import comparisons, spread
from .dataset_summary import DIRECTIONS, DatasetSummary, summarize
from .peaks import EARLY, Peaks
from .simulate import generate

PAGE = 'README.md'
SHEET = 24
"""Number of falls on the contact sheet."""


def main(arguments: list[str]) -> int:
    """Run `ragdoll_falls describe`; returns the exit code 0."""
    options = parser().parse_args(arguments)
    summary = summarize(options.folder)
    numbers = np.unique(np.linspace(0, len(summary.hits) - 1, SHEET).round().astype(int))
    falls = list(generate(summary.recipe, numbers.tolist()))
    drawn = pictures.draw_all(summary, falls, options.folder)
    page = options.folder / PAGE
    page.write_text(page_text(summary, drawn), encoding='utf-8')
    print('\n'.join(summary_lines(summary)))
    print(f'{page} and {len(drawn)} pictures')
    for each in comparisons(summary):
        if each.outside:
            print(f'warning: {each.warning}', file=sys.stderr)
    return 0


def parser() -> argparse.ArgumentParser:
    """Options of `ragdoll_falls describe`."""
    parser = argparse.ArgumentParser(
        'ragdoll_falls describe', description=__doc__, epilog='example: ragdoll_falls describe '
        f'falls; writes falls/{PAGE} and pictures')
    parser.add_argument('folder', type=Path, help='a data set of the format lerobot')
    return parser


def summary_lines(summary: DatasetSummary) -> list[str]:
    """Directions of the falls, and the peaks of the first IMU with their widths."""
    shares = ', '.join(f'{name} {share:.0%}' for name, share in
                       zip(DIRECTIONS, summary.share_towards(), strict=True))
    return [f'directions: {shares}', *(['peaks ' + text for text in _peaks(summary.peaks)])]


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
        '## Compared with real falls', '',
        '| | simulated | real falls | | source |', '| --- | --- | --- | --- | --- |',
        *(each.row for each in comparisons(summary)), '',
        'Outside: the mean is more than a standard deviation of the real falls away from theirs, a '
        f'share differs by more than {SHARE_TOLERANCE:.0%}, or a median is outside the range.', '',
        *(f'Peaks {text}.\n' for text in _peaks(summary.peaks)),
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


def _peaks(peaks: Peaks) -> list[str]:
    """Heights and widths of a sensor's peaks, and how many are early, as a list of one line; empty
    without samples.
    """
    if not np.isfinite(peaks.largest).any():
        return []
    low, middle, high = np.nanpercentile(peaks.largest, [5, 50, 95])
    return [f'at {peaks.sensor}: {middle:.1f} g in the median (5 % below {low:.1f}, 5 % above '
            f'{high:.1f}), {1000 * np.nanmedian(peaks.widths):.0f} ms wide at half their height; '
            '{:.0%} of the falls pass {:g} g before the first contact, {:.0%} before the pelvis '
            'touches the ground'.format(peaks.shares_early[0], EARLY, peaks.shares_early[1])]


def _bones(summary: DatasetSummary) -> list[str]:
    known = np.isfinite(summary.impact_speeds)
    return [f'| {name} | {known[:, bone].mean():.0%} | '
            f'{spread(summary.impact_speeds[known[:, bone], bone])} |'
            for bone, name in enumerate(summary.bones)
            if name not in summary.recipe.data['feet']]


def _impacts(summary: DatasetSummary) -> list[str]:
    """Lines on how hard each region of the body is hit; empty if no bone has a region."""
    if not summary.regions:
        return []
    rows = [f'| {name} | {np.isfinite(ratios).mean():.0%} | {spread(forces, 0)} | '
            f'{spread(ratios, 1)} |' for name, forces, ratios in zip(
                summary.regions, summary.peak_forces.T, summary.ratios.T, strict=True)]
    return ['## Impacts', '', '| region | falls in which it hits | peak force, N | ratio to its '
            'limit |', '| --- | --- | --- | --- |', *rows, '',
            f'HIC15 of the head: {spread(summary.hic15, 0)}.', '',
            'Of each fall the impact that is nearest to the limit. Forces are those of a stated '
            'contact law, limits those of pain from contact with robots (ISO/TS 15066): see '
            'docs/falls.md of ragdoll_ros.', '']
