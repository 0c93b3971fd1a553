"""What `ragdoll_fit` makes of all robots below a folder, and how they fall: a table and a summary.

nice python test/strangers.py FOLDER [--suffix .urdf .xacro .sdf] [--csv rows.csv]

Each file is fitted as the command does, read back, and dropped from 0.4 m for 5 s at `draft`, in
one process with a time-out. A file that equals one before it is left out, and so is a .xacro that
names no robot: it holds macros. Set AMENT_PREFIX_PATH and ROS_PACKAGE_PATH for the packages that
files name.
"""
from __future__ import annotations

import argparse
import contextlib
import csv
import hashlib
import io
import multiprocessing
import re
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

from ragdoll_ros import Simulation, load_scene
from ragdoll_ros.fit.command import main as fit
from ragdoll_ros.model.errors import RagdollError
from ragdoll_ros.model.scene import above_ground

DURATION = 5.0
"""s of the fall."""

BUSY = 1.0
"""s in which a tick is timed: most of the impacts are within."""

SLOW = 5.0
"""ms per tick, the half of what real time allows."""

ENERGY_EXCESS = 0.01
"""Share of the energy of the drop, m g h of its size, above which energy is from nothing."""

NAMED = re.compile(rb'<robot\b[^>]*\bname\s*=')

SUFFIXES = ('.urdf', '.xacro', '.sdf')


@dataclass
class Row:
    """What became of one file; ``outcome`` is one word, ``said`` the error or the last frame."""

    file: str
    outcome: str
    bodies: int = 0
    mass: float = 0.0
    verdict: str = ''
    ms_per_tick: float = 0.0
    """CPU, the mean of the BUSY seconds."""
    slowest_ms: float = 0.0
    energy_excess: float = 0.0
    """Share of m g times the size."""
    joint_gap: float = 0.0
    """m, the largest."""
    asleep_after: float = 0.0
    """s, 0 for one that is awake at the end."""
    seconds: float = 0.0
    said: str = ''


def find_robots(folder: Path, suffixes: tuple[str, ...]) -> Iterator[Path]:
    """Files of robots, one of those that are equal to the byte in folders of one name."""
    seen = set()
    for path in sorted(folder.rglob('*')):
        if path.suffix.lower() not in suffixes or not path.is_file():
            continue
        data = path.read_bytes()
        if path.suffix.lower() == '.xacro' and not NAMED.search(data):
            continue
        key = hashlib.sha256(data).digest()
        if key not in seen:
            seen.add(key)
            yield path


def examine(path: Path) -> Row:
    """Fit a file, read what was written, and let it fall."""
    row, begun = Row(str(path), 'crashed'), time.monotonic()
    try:
        _examine(path, row)
    except RagdollError as error:
        row.outcome, row.said = 'does not fall', ' '.join(str(error).split())
    except BaseException:  # an exception of any kind is a crash, and is what is sought
        row.outcome, row.said = 'crashed', ' '.join(traceback.format_exc(limit=-2).split())
    row.seconds = time.monotonic() - begun
    return row


def _examine(path: Path, row: Row) -> None:
    said, report = io.StringIO(), io.StringIO()
    with tempfile.TemporaryDirectory() as folder:
        written = Path(folder, 'doll.yaml')
        with contextlib.redirect_stderr(said), contextlib.redirect_stdout(report):
            code = fit([str(path), '-o', str(written)])
        if code:
            row.outcome, row.said = 'refused', said.getvalue().strip()
            return
        row.verdict = report.getvalue().rpartition('verdict: ')[2].strip()
        _fall(str(written), row)


def _fall(written: str, row: Row) -> None:
    scene = load_scene(written)
    if len(scene.dolls) == 1:
        scene = above_ground(scene.dolls[0].doll)
    row.bodies, row.mass = len(scene.bones), sum(bone.mass for bone in scene.bones)
    size, costs = max(placement.doll.extent for placement in scene.dolls), []
    with Simulation(scene, accuracy='draft') as simulation:
        for _ in range(round(DURATION / simulation.step)):
            begun = time.process_time()
            state = simulation.advance()
            costs.append(1e3 * (time.process_time() - begun))
            if not np.isfinite(state.rows).all():
                row.outcome = 'not finite'
                return
            if simulation.asleep:
                row.asleep_after = simulation.time / 1e9
                break
        measures = simulation.measures()
    busy = costs[1:round(BUSY / simulation.step)]
    row.ms_per_tick, row.slowest_ms = float(np.mean(busy)), float(np.max(busy))
    row.energy_excess = measures['energy_excess_J'] / (9.8 * row.mass * max(size, 0.4))
    row.joint_gap = measures['joint_gap_m']
    row.outcome = 'energy' if row.energy_excess > ENERGY_EXCESS else (
        'slow' if row.ms_per_tick > SLOW else 'falls')


def _serve(pipe: Connection) -> None:
    while (path := pipe.recv()) is not None:
        pipe.send(examine(path))


class Worker:
    """A process that examines one file after another; one that takes too long is replaced."""

    def __init__(self, limit: float) -> None:
        self._limit, self._process = limit, None

    def examine(self, path: Path) -> Row:
        if self._process is None:
            self._pipe, other = multiprocessing.Pipe()
            self._process = multiprocessing.get_context('spawn').Process(
                target=_serve, args=(other,), daemon=True)
            self._process.start()
            other.close()
        self._pipe.send(path)
        try:
            if self._pipe.poll(self._limit):
                return self._pipe.recv()
            row = Row(str(path), 'too long', said=f'over {self._limit:g} s')
        except (EOFError, ConnectionError):
            self._process.join()
            row = Row(str(path), 'crashed', said=f'exit code {self._process.exitcode}')
        self._process.kill()
        self._process = None
        return row

    def close(self) -> None:
        if self._process is not None:
            self._pipe.send(None)
            self._process.join()


def main(arguments: list[str] | None = None) -> None:
    """Print a line for each file and the summary."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('folder', type=Path)
    parser.add_argument('--suffix', nargs='+', default=list(SUFFIXES))
    parser.add_argument('--limit', type=float, default=120.0, help='s for one file (default 120)')
    parser.add_argument('--csv', type=Path, help='write the rows to this file')
    options = parser.parse_args(arguments)
    worker, rows = Worker(options.limit), []
    with contextlib.ExitStack() as stack:
        stack.callback(worker.close)
        table = None
        if options.csv:
            file = stack.enter_context(options.csv.open('w', newline='', encoding='utf-8'))
            table = csv.DictWriter(file, [field.name for field in fields(Row)])
            table.writeheader()
        for path in find_robots(options.folder, tuple(options.suffix)):
            row = worker.examine(path)
            row.file = str(path.relative_to(options.folder))
            rows.append(row)
            print(f'{row.outcome:13} {row.bodies:4} {row.ms_per_tick:6.2f} ms {row.verdict:8} '
                  f'{row.file} {row.said[:200]}', flush=True)
            if table:
                table.writerow(asdict(row))
                file.flush()
    print(summary(rows))


def summary(rows: list[Row]) -> str:
    """Counts of outcomes, and what falling costs."""
    counts = Counter(row.outcome for row in rows)
    fell = [row for row in rows if row.outcome in ('falls', 'slow', 'energy')]
    costs = [row.ms_per_tick for row in fell] or [0.0]
    small = [row for row in fell if row.bodies <= 60]
    return '\n'.join([
        '', f'| of {len(rows)} files | |', '| --- | --- |',
        *(f'| {outcome} | {count} |' for outcome, count in counts.most_common()),
        f'| bodies | {min((row.bodies for row in fell), default=0)} to '
        f'{max((row.bodies for row in fell), default=0)} |',
        f'| ms per tick: median, 95 %, largest | {np.median(costs):.2g}, '
        f'{np.percentile(costs, 95):.2g}, {max(costs):.2g} |',
        f'| up to 60 bodies, over {SLOW:g} ms per tick | '
        f'{sum(row.ms_per_tick > SLOW for row in small)} of {len(small)} |',
        f'| largest energy excess, share of m g size | '
        f'{max((row.energy_excess for row in fell), default=0):.1g} |',
        f'| asleep within {DURATION:g} s | {sum(row.asleep_after > 0 for row in fell)} |'])


if __name__ == '__main__':
    sys.exit(main())
