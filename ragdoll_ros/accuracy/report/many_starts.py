"""`python -m ragdoll_ros.accuracy.report.many_starts`: a report of 10 008 random starts."""
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

STARTS_PER_CLASS = 1112


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the starts and write DIR/accuracy.json and the page; 1 if a criterion is not met."""
    parser = argparse.ArgumentParser(
        prog='python -m ragdoll_ros.accuracy.report.many_starts',
        description='Simulate 10 008 random starts of the default doll, each until 15 s '
        'after the end of its trial, and check energy gain, limit overshoot, penetration and rest.',
        epilog='example: python -m ragdoll_ros.accuracy.report.many_starts --starts 20 '
               '--out /tmp/starts')
    parser.add_argument('--starts', type=int, default=STARTS_PER_CLASS, metavar='N',
                        help=f'starts of each of the nine classes ({STARTS_PER_CLASS})')
    parser.add_argument('--accuracy', action='append', choices=list(ACCURACIES),
                        help='repeatable (normal)')
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
    """Run the starts at the accuracies; returns the data of the JSON."""
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
