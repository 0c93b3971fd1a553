"""`python -m ragdoll_ros.accuracy.report.many_starts`: 10 008 starts, as a page of their own."""
from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from ...physics.accuracy import ACCURACIES
from ..cases.starts import CLASSES
from ..parts import start_classes
from ..results import figures
from ..results.criteria import criteria
from ..results.runner import run_jobs
from .command import write

EACH = 1112
"""Starts of each of the nine classes."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the starts, write DIR/accuracy.json and the page; 1 if a promise about them fails."""
    parser = argparse.ArgumentParser(
        prog='python -m ragdoll_ros.accuracy.report.many_starts',
        description='Let the default doll go in 10 008 random ways, each until 15 s after its own '
        'time, and look for energy from nothing, limits passed, bones sunk, and what does not '
        'come to rest.',
        epilog='example: python -m ragdoll_ros.accuracy.report.many_starts --starts 20 '
               '--out /tmp/starts')
    parser.add_argument('--starts', type=int, default=EACH, metavar='N',
                        help=f'starts of each of the nine classes ({EACH})')
    parser.add_argument('--accuracy', action='append', choices=list(ACCURACIES),
                        help='may be given again (normal)')
    parser.add_argument('--out', type=Path, default=Path('docs/starts'), metavar='DIR',
                        help='folder to write into (docs/starts)')
    options = parser.parse_args(arguments)
    if options.starts < 1:
        parser.error(f'--starts {options.starts}: expected 1 or more')
    folder = options.out.absolute()
    folder.mkdir(parents=True, exist_ok=True)
    data = measured(options.starts, options.accuracy or ['normal'])
    figures.save(data, folder)
    write(folder)
    return 0 if all(row['met'] for row in criteria(data['figures'])) else 1


def measured(starts: int, settings: Sequence[str]) -> dict:
    """What the JSON holds, from running the starts at the settings."""
    began = time.monotonic()
    rows = run_jobs([job for setting in settings for name in CLASSES
                     for job in start_classes.chunks(name, f'ours-{setting}', starts)])
    rows[start_classes.NAME] = start_classes.merged(rows[start_classes.NAME])
    words = ' '.join(f'--accuracy {setting}' for setting in settings)
    command = f'python -m ragdoll_ros.accuracy.report.many_starts {words} --starts {starts}'
    return {'about': figures.about(command, time.monotonic() - began, False, starts),
            'figures': rows}


if __name__ == '__main__':
    sys.exit(main())
