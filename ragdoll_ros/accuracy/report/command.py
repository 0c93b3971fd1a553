"""`ragdoll_report`: run every part by every method, write JSON, Markdown and pictures."""
import argparse
import importlib.util
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from ..methods import missing_peers
from ..parts import (
    collisions,
    convergence,
    costs,
    drop_statistics,
    energy,
    error_estimate,
    fainting_falls,
    hard,
    orders,
    restitution,
    short_segments,
    start_classes,
    swing,
    work_precision,
)
from ..results import figures
from ..results.runner import Job, RunOptions, run_jobs
from .plots import draw_all
from .sections import markdown

PARTS = {'precision': work_precision, 'orders': orders, 'restitution': restitution,
         'convergence': convergence, 'pieces': short_segments, 'drop': energy,
         'drops': drop_statistics, 'classes': start_classes, 'collisions': collisions,
         'hard': hard, 'costs': costs, 'estimate': error_estimate, 'swing': swing,
         'faints': fainting_falls}
"""Modules by their names for --case; each has a function jobs()."""

MERGED = {start_classes.NAME: start_classes.merged, start_classes.COMPARED: start_classes.merged,
          drop_statistics.NAME: drop_statistics.merged}
"""Parts whose jobs give rows of chunks, and what joins them."""

NEEDED = ('scipy', 'matplotlib', 'mujoco')
"""Packages of the extra `report`, imported only where they are used."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; exit code 2 for a wrong call or a missing package."""
    options = parser().parse_args(arguments)
    missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if missing:
        sys.stderr.write(f'ragdoll_report needs {", ".join(missing)}: '
                         'pip install "ragdoll_ros[report]"\n')
        return 2
    try:
        return report(options)
    except WrongCall as error:
        sys.stderr.write(f'ragdoll_report: {error}\n')
        return 2


class WrongCall(ValueError):
    """An invalid value of an option."""


def parser() -> argparse.ArgumentParser:
    """Options of the command."""
    made = argparse.ArgumentParser(
        prog='ragdoll_report', description='Measure errors and CPU time of the simulation, '
        'compared with PyBullet and MuJoCo, and with DART and Drake where they are installed. '
        'Writes accuracy.json, accuracy.md and pictures.',
        epilog='example: ragdoll_report --quick --out /tmp/report; '
        'ragdoll_report --case classes --starts 300; ragdoll_report --case pieces --update')
    made.add_argument('--quick', action='store_true',
                      help='fewer motions, methods and starts: at most 90 s (else 60 min)')
    made.add_argument('--case', action='append', metavar='NAME', default=[],
                      help='only this part or motion; repeatable; "list" prints all names')
    made.add_argument('--starts', type=int, default=100, metavar='N',
                      help='starts of each of the nine classes (100)')
    made.add_argument('--out', type=Path, metavar='DIR', help='output folder (docs; with --case '
                      'build/report, so that the published page stays complete)')
    made.add_argument('--update', action='store_true',
                      help='with --case: replace these parts in DIR/accuracy.json (docs) and leave '
                      'the others as they are')
    made.add_argument('--from-json', action='store_true',
                      help='run nothing, rewrite page and pictures from DIR/accuracy.json')
    return made


def report(options: argparse.Namespace) -> int:
    """Run the jobs unless --from-json is given, then write; returns 0. ``--case list`` only prints
    the names.
    """
    if options.case == ['list']:
        sys.stdout.write('\n'.join(labels()) + '\n')
        return 0
    apart = options.case and not options.update
    options.out = options.out or Path('build/report' if apart else 'docs')
    folder = options.out.absolute()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise WrongCall(f'--out {options.out}: {error.strerror}') from None
    if options.from_json:
        written('--from-json', folder)
    elif options.update:
        figures.save(updated(written('--update', folder), options), folder)
    else:
        figures.save(measured(options), folder)
    write(folder)
    return 0


def written(option: str, folder: Path) -> dict:
    """Data of an earlier report, which an option needs."""
    if not (folder / figures.FILE).is_file():
        raise WrongCall(f'{option}: there is no {folder / figures.FILE}')
    return figures.load(folder)


def updated(data: dict, options: argparse.Namespace) -> dict:
    """Data of a report in which whole parts are measured again."""
    single = [name for name in options.case if name not in PARTS]
    if single or not options.case:
        raise WrongCall(f'--update: {single[0] if single else "no --case"}: expected whole parts, '
                        f'--case of {", ".join(PARTS)}')
    return figures.merged(data, measured(options))


def measured(options: argparse.Namespace) -> dict:
    """Run the jobs; returns the data of the JSON."""
    if options.starts < 1:
        raise WrongCall(f'--starts {options.starts}: expected 1 or more')
    began, missing = time.monotonic(), missing_peers()
    if missing:
        sys.stderr.write(f'not compared, as not installed: {", ".join(missing)} '
                         '(pip install "ragdoll_ros[peers]")\n')
    rows = run_jobs(chosen(options.case, RunOptions(options.quick, options.starts)))
    for part, merged in MERGED.items():
        if part in rows:
            rows[part] = merged(rows[part])
    words = ['ragdoll_report', *(['--quick'] if options.quick else []),
             *(f'--case {name}' for name in options.case),
             *([f'--starts {options.starts}'] if options.starts != 100 else [])]
    about = figures.about(' '.join(words), time.monotonic() - began, options.quick, options.starts)
    return {'about': {**about, 'missing': missing}, 'figures': rows}


def write(folder: Path) -> None:
    """Write the page and pictures from the JSON in a folder."""
    data = figures.load(folder)
    pictures = draw_all(data['figures'], folder)
    page = folder / 'accuracy.md'
    page.write_text(markdown(data, pictures), encoding='utf-8')
    sys.stdout.write(f'{page} and {len(pictures)} pictures\n')


def chosen(names: Sequence[str], options: RunOptions) -> list[Job]:
    """All jobs, or those of the named parts and motions; WrongCall for an unknown name."""
    jobs = [(part, job) for part, module in PARTS.items() for job in module.jobs(options)]
    for name in names:
        if any(name in (part, job.part, job.label) for part, job in jobs):
            continue
        if name in labels():
            raise WrongCall(f'--case {name}: not in the quick report; leave --quick out')
        raise WrongCall(f'--case {name}: expected one of {", ".join(labels())}')
    return [job for part, job in jobs
            if not names or {part, job.part, job.label}.intersection(names)]


def labels() -> list[str]:
    """Valid names for --case."""
    return [*PARTS, *work_precision.motions()]


if __name__ == '__main__':
    sys.exit(main())
