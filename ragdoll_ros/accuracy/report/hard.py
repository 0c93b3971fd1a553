"""`python -m ragdoll_ros.accuracy.report.hard`, `make hard`: run the hard cases alone."""
from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from ...physics.accuracy import ACCURACIES
from ..cases.hard_cases import hard_cases
from ..parts import hard
from ..results.runner import RunOptions, run_jobs
from .sections import HARD


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the cases and print a table; exit code 1 if one fails, 2 if there is no such case."""
    parser = argparse.ArgumentParser(
        prog='python -m ragdoll_ros.accuracy.report.hard', description='Run the hard cases.',
        epilog='example: python -m ragdoll_ros.accuracy.report.hard --case "drop 50 m"')
    parser.add_argument('--case', default='', help='only cases whose name contains this text')
    parser.add_argument('--accuracy', default='normal', choices=list(ACCURACIES))
    options = parser.parse_args(arguments)
    jobs = [job for job in hard.jobs(RunOptions(), options.accuracy)
            if options.case in job.label and 'bullet' not in job.label]
    if not jobs:
        names = ', '.join([*(case.name for case in hard_cases()), hard.RESTING])
        sys.stderr.write(f'no case contains {options.case!r}; cases: {names}\n')
        return 2
    rows = run_jobs(jobs)[hard.NAME]
    sys.stdout.write('\n\n'.join(HARD.tables(rows)) + '\n')
    return 0 if all(row.get('passed') for row in rows) else 1


if __name__ == '__main__':
    sys.exit(main())
