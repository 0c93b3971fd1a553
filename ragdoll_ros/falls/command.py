"""Generate a data set of falls: drawn from a recipe, simulated on all cores."""
import argparse
import os
import sys
import time
from functools import partial
from pathlib import Path

from ..files.config import RECIPES, names_in
from ..model.errors import RagdollError
from . import cluster, describe, pool
from .formats.registry import FORMATS
from .manifest import Manifest, build_dataset
from .recipe import load_recipe
from .shard import DatasetJob

LOG_INTERVAL = 15.0
"""s between lines if stderr is no terminal."""

EXAMPLE = """examples:
  ragdoll_falls shove -o falls --count 1000       a recipe of config/recipes/, Parquet, all cores
  ragdoll_falls shove -o falls --count 1000 --resume    continue an interrupted run
  ragdoll_falls describe falls                    a page and pictures about the data set
  ragdoll_falls mine.yaml -o csv --format kfall   one CSV file per fall
  ragdoll_falls mine.yaml -o all --format lerobot,kfall    several formats of the same falls
"""


def main(arguments: list[str] | None = None) -> int:
    """Run the command and return its exit code: 0, 1 after an error in the run, 2 for a wrong call
    or any error of `describe`, 130 for Ctrl-C while falls are made.
    """
    arguments = sys.argv[1:] if arguments is None else arguments
    if arguments[:1] == ['describe']:
        try:
            return describe.main(arguments[1:])
        except (RagdollError, OSError) as error:
            print(error, file=sys.stderr)
            return 2
    options = parser().parse_args(arguments)
    progress = ProgressLine(options.count)
    try:
        job = DatasetJob(load_recipe(options.recipe), options.count, options.format)
        for warning in job.recipe.warnings:
            print(f'warning: {warning}', file=sys.stderr)
        make = partial(pool.make_shards, workers=options.workers)
        if options.ray is not None:
            make = partial(cluster.make_shards, address=options.ray, workers=options.workers)
        manifest = build_dataset(job, options.out, make, options.resume, progress.update)
    except RagdollError as error:
        progress.close()
        print(error, file=sys.stderr)
        return 1 if isinstance(error, pool.WorkersDied) else 2
    except OSError as error:
        progress.close()
        print(f'{error.filename or options.out}: {error.strerror}; finished shards are '
              'kept, --resume continues', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        progress.close()
        print('Interrupted; finished shards are kept, --resume continues', file=sys.stderr)
        return 130
    progress.close()
    _print_result(manifest, options.out, progress.seconds)
    return 0


def parser() -> argparse.ArgumentParser:
    """Options of the command."""
    parser = argparse.ArgumentParser(
        'ragdoll_falls', description=__doc__, epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('recipe', help='a YAML file, or a recipe of config/recipes/: '
                        + ', '.join(names_in(RECIPES)))
    parser.add_argument('-o', '--out', type=Path, required=True, metavar='FOLDER',
                        help='output folder of the data set')
    parser.add_argument('--count', type=int, default=100, help='number of falls (%(default)s)')
    parser.add_argument('--format', type=formats, default='lerobot', metavar='FORMAT[,FORMAT]',
                        help='one format or several of the same falls: ' + '; '.join(
        f'{name}: {about}' for name, about in FORMATS.items()) + ' (%(default)s)')
    parser.add_argument('--settled', dest='format', action='store_const', const='settled',
                        help='the same as --format settled')
    parser.add_argument('--workers', type=workers, default='auto',
                        help='worker processes, or auto: one per core (%(default)s)')
    parser.add_argument('--ray', nargs='?', const=cluster.LOCAL, metavar='ADDRESS',
                        help='use the Ray cluster at ADDRESS, or a local Ray instance')
    parser.add_argument('--resume', action='store_true',
                        help='keep the complete shards (parts of the data set) in the folder, and '
                        'make the rest')
    return parser


def formats(text: str) -> str:
    """Parse names of formats: each once, in the order of FORMATS."""
    given = text.split(',')
    if unknown := [name for name in given if name not in FORMATS]:
        raise argparse.ArgumentTypeError(
            f'{", ".join(map(repr, unknown))}: expected names separated by commas, of '
            + ', '.join(FORMATS))
    return ','.join(name for name in FORMATS if name in given)


def workers(text: str) -> int:
    """Parse the number of processes."""
    if text == 'auto':
        return len(os.sched_getaffinity(0))
    if not text.isdigit() or not 1 <= int(text) <= 1024:
        raise argparse.ArgumentTypeError(f'{text}: expected auto, or 1 to 1024')
    return int(text)


def _print_result(manifest: Manifest, folder: Path, seconds: float) -> None:
    size = sum((folder / name).stat().st_size for entry in manifest.shards.values()
               for name in entry['files'])
    print(f'{manifest.done} falls in {folder}, {size / manifest.done / 1000:.0f} kB each, '
          f'{seconds:.0f} s')
    for number, reason in manifest.failures.items():
        print(f'fall {number} failed: {reason}')


class ProgressLine:
    """Progress of a run of ``count`` falls; on a terminal one line that is rewritten."""

    def __init__(self, count: int) -> None:
        self._count, self._new = count, 0
        self._began = self._printed = time.monotonic()
        self._terminal = sys.stderr.isatty()

    def update(self, manifest: Manifest, new: int) -> None:
        """Count ``new`` more falls and print; without a terminal, at most every LOG_INTERVAL."""
        self._new += new
        now = time.monotonic()
        if self._terminal:
            sys.stderr.write(f'\r{self._text(manifest, now):78}')
        elif now - self._printed > LOG_INTERVAL:
            self._printed = now
            sys.stderr.write(self._text(manifest, now) + '\n')
        sys.stderr.flush()

    def close(self) -> None:
        """End the line."""
        if self._terminal:
            sys.stderr.write('\n')

    @property
    def seconds(self) -> float:
        """Time since the beginning, s."""
        return time.monotonic() - self._began

    def _text(self, manifest: Manifest, now: float) -> str:
        done, failed = manifest.done, len(manifest.failures)
        rate = self._new / max(now - self._began, 1e-9)
        left = f', {_duration((self._count - done) / rate)} left' if rate else ''
        return f'{done} of {self._count} falls, {rate:.1f} a second{left}, {failed} failed'


def _duration(seconds: float) -> str:
    minutes, hours = seconds / 60, seconds / 3600
    return (f'{seconds:.0f} s' if seconds < 100 else
            f'{minutes:.0f} min' if minutes < 100 else f'{hours:.1f} h')


if __name__ == '__main__':
    sys.exit(main())
