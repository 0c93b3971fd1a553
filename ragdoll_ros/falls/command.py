"""Falls by the thousand: drawn by a recipe, simulated on all cores, written as a data set."""
from __future__ import annotations

import argparse
import os
import sys
from functools import partial
from pathlib import Path

from ..model.errors import RagdollError
from . import cluster, describe, pool
from .formats.registry import FORMATS
from .generate import run
from .manifest import Manifest
from .progress import Progress
from .recipe import load_recipe
from .shard import Order

EXAMPLE = """examples:
  ragdoll_falls shove -o falls --count 1000       a recipe of config/, Parquet, all cores
  ragdoll_falls shove -o falls --count 1000 --resume    goes on where a run was ended
  ragdoll_falls describe falls                    a page and pictures of what is in it
  ragdoll_falls mine.yaml -o csv --format kfall   one CSV a fall
"""


def main(arguments: list[str] | None = None) -> int:
    """Run the command: 0, 1 if it had to stop on its way, 2 for a wrong call, 130 after Ctrl-C."""
    arguments = sys.argv[1:] if arguments is None else arguments
    if arguments[:1] == ['describe']:
        return _describe(arguments[1:])
    options = parser().parse_args(arguments)
    progress = Progress(options.count)
    try:
        order = Order(load_recipe(options.recipe), options.count, options.format)
        make = partial(pool.make_shards, workers=options.workers)
        if options.ray is not None:
            make = partial(cluster.make_shards, address=options.ray, workers=options.workers)
        manifest = run(order, options.out, make, options.resume, progress.tell)
    except RagdollError as error:
        progress.close()
        print(error, file=sys.stderr)
        return 1 if isinstance(error, pool.WorkersDied) else 2
    except OSError as error:
        progress.close()
        print(f'{error.filename or options.out}: {error.strerror}; what is there stays, and '
              '--resume goes on', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        progress.close()
        print('Stopped; what is there stays, and --resume goes on', file=sys.stderr)
        return 130
    progress.close()
    _say(manifest, options.out, progress.seconds)
    return 0


def _describe(arguments: list[str]) -> int:
    try:
        return describe.main(arguments)
    except (RagdollError, OSError) as error:
        print(error, file=sys.stderr)
        return 2


def parser() -> argparse.ArgumentParser:
    """Options of the command."""
    parser = argparse.ArgumentParser(
        'ragdoll_falls', description=__doc__, epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('recipe', help='a YAML file, or a recipe of config/: faint, shove, tumble')
    parser.add_argument('-o', '--out', type=Path, required=True, metavar='FOLDER',
                        help='where the data set is written')
    parser.add_argument('--count', type=int, default=100, help='how many falls (%(default)s)')
    parser.add_argument('--format', choices=FORMATS, default='lerobot', help='; '.join(
        f'{name}: {about}' for name, about in FORMATS.items()) + ' (%(default)s)')
    parser.add_argument('--settled', dest='format', action='store_const', const='settled',
                        help='the same as --format settled')
    parser.add_argument('--workers', type=workers, default='auto',
                        help='processes, or auto: as many as there are cores (%(default)s)')
    parser.add_argument('--ray', nargs='?', const=cluster.HERE, metavar='ADDRESS',
                        help='by Ray: of the cluster at an address, or begun here for this run')
    parser.add_argument('--resume', action='store_true',
                        help='keep what is whole in the folder, make the rest')
    return parser


def workers(text: str) -> int:
    """Read a number of processes."""
    if text == 'auto':
        return len(os.sched_getaffinity(0))
    if not text.isdigit() or not 1 <= int(text) <= 1024:
        raise argparse.ArgumentTypeError(f'{text}: expected auto, or 1 to 1024')
    return int(text)


def _say(manifest: Manifest, folder: Path, seconds: float) -> None:
    size = sum((folder / name).stat().st_size for entry in manifest.shards.values()
               for name in entry['files'])
    print(f'{manifest.done} falls in {folder}, {size / manifest.done / 1000:.0f} kB each, '
          f'{seconds:.0f} s')
    for number, reason in manifest.failures.items():
        print(f'fall {number} failed: {reason}')


if __name__ == '__main__':
    sys.exit(main())
