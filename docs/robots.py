"""Write docs/robots.md: the results of `ragdoll_fit` for every URDF of some packages.

python docs/robots.py pybullet_data=FOLDER example-robot-data=FOLDER ... > docs/robots.md
python docs/robots.py --summary docs/robots.md

Standard error names the fastest body of each robot that is still awake, and its speed. The summary
of the packages is the table in docs/fit.md.
"""
from __future__ import annotations

import contextlib
import itertools
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ragdoll_ros.fit.judging.plausibility import find_implausible
from ragdoll_ros.fit.judging.verdict import judge
from ragdoll_ros.fit.robots.robot import read_urdf
from ragdoll_ros.model.errors import RagdollError
from ragdoll_ros.model.ragdoll import Ragdoll
from ragdoll_ros.model.scene import above_ground
from ragdoll_ros.physics.simulation import Simulation

LONGEST = 10.0
"""Duration of each simulation, s."""

MANY = 500
"""Number of files in one folder from which they share a row."""

HEAD = """# Robots that were fitted

What [`ragdoll_fit`](fit.md#a-robots-urdf) makes of every URDF of some packages on PyPI: the root,
the number of bodies, the mass, the number of warnings in the report, and the
[verdict](fit.md#the-verdict). Each doll is then dropped from 0.4 m with the engine `rigid`: the
last columns are the processor time of a tick in the first second, and the time after which the doll
sleeps (`no`: it is awake after 10 s). For a file that is refused, the row has the error message,
and whether PyBullet loads the file.
Written by `docs/robots.py`.
"""

LOADS = 'import pybullet as p, sys; p.connect(p.DIRECT); p.loadURDF(sys.argv[1])'


def main(arguments: list[str]) -> None:
    """Write the table, or the summary of one, to standard output."""
    if arguments[:1] == ['--summary']:
        print(summary(Path(arguments[1]).read_text(encoding='utf-8')))
        return
    print(HEAD)
    for argument in arguments:
        name, _, folder = argument.partition('=')
        paths = sorted(Path(folder).rglob('*.urdf'))
        print(f'## {name}\n\n| file | root | bodies | kg | warnings | verdict | ms a tick '
              '| asleep after |\n| --- | --- | --- | --- | --- | --- | --- | --- |')
        for _, each in itertools.groupby(paths, lambda path: path.parent.parent):
            for line in lines(list(each), Path(folder)):
                print(line, flush=True)
        print()


def lines(paths: list[Path], folder: Path) -> Iterator[str]:
    """A row for each file, or one row for MANY."""
    if len(paths) < MANY:
        for path in paths:
            yield f'| {path.relative_to(folder)} | {row(path)} |'
        return
    dolls = []
    for path in paths:
        with contextlib.suppress(RagdollError):
            dolls.append(read_urdf(path))
    counts = sorted(len(doll.bones) for doll, _ in dolls)
    masses = sorted(doll.mass for doll, _ in dolls)
    warned = sum(bool(notes) for _, notes in dolls)
    yield (f'| {len(dolls)} of {len(paths)} files like {paths[0].relative_to(folder)} | | '
           f'{counts[0]} to {counts[-1]} | {masses[0]:.3g} to {masses[-1]:.3g} | '
           f'in {warned} | | | |')


def row(path: Path) -> str:
    """The row of one file."""
    try:
        doll, notes = read_urdf(path)
    except RagdollError as error:
        done = subprocess.run([sys.executable, '-c', LOADS, str(path)], capture_output=True,
                              check=False, timeout=100)
        loads = 'PyBullet loads it' if done.returncode == 0 else 'PyBullet does not load it'
        said = str(getattr(error, 'errors', [error])[0]).replace('|', '/')
        return f'refused: {said} ({loads}) | | | | | |'
    warnings = len(notes) + len(find_implausible(doll))
    return (f'{doll.root.name} | {len(doll.bones)} | {doll.mass:.4g} | {warnings or ""} | '
            f'{judge(doll, measured=True).word} | {fall(doll)}')


def fall(doll: Ragdoll) -> str:
    """Milliseconds per tick in the first second, and time of sleep; or why it does not run."""
    spent = 0.0
    try:
        with contextlib.closing(Simulation(above_ground(doll))) as simulation:
            state = simulation.advance()
            while simulation.time < LONGEST * 1e9 and not simulation.asleep:
                before = time.process_time()
                state = simulation.advance()
                spent += (time.process_time() - before) * (simulation.time <= 1_000_000_000)
            if not simulation.asleep:
                speeds = np.linalg.norm(state.linear_velocities, axis=1)
                spins = np.linalg.norm(state.angular_velocities, axis=1)
                print(f'{doll.name}: {doll.bones[speeds.argmax()].name} {speeds.max():.3g} m/s, '
                      f'{doll.bones[spins.argmax()].name} {spins.max():.3g} rad/s',
                      file=sys.stderr, flush=True)
            asleep = f'{simulation.time / 1e9:.1f} s' if simulation.asleep else 'no'
            return f'{10 * spent:.2f} | {asleep}'
    except RagdollError as error:
        return f'does not run: {error} |'


def summary(page: str) -> str:
    """A row for each package of a page: counts, ranges, costs, verdicts, and how many sleep."""
    found = ['| package | URDFs | fitted | bodies | kg | ms per tick: median, largest '
             '| verdict: good, doubtful | asleep within 10 s |',
             '| --- | --- | --- | --- | --- | --- | --- | --- |']
    for section in page.split('\n## ')[1:]:
        rows = [[cell.strip() for cell in line.strip('|').split('|')]
                for line in section.splitlines() if line.startswith('| ')][2:]
        many = [tuple(map(int, re.match(r'(\d+) of (\d+) files', row[0]).groups()))
                for row in rows if ' files like ' in row[0]]
        fell = [row for row in rows if row[6]]
        ends = [[float(end) for row in rows if row[column] for end in row[column].split(' to ')]
                for column in (2, 3)]
        costs = [float(row[6]) for row in fell]
        files = len(rows) + sum(count - 1 for _, count in many)
        fitted = len(fell) + sum(count for count, _ in many)
        bodies, masses = (f'{min(each):.4g} to {max(each):.4g}' for each in ends)
        words = [sum(row[5] == word for row in fell) for word in ('good', 'doubtful')]
        asleep = sum(row[7] != 'no' for row in fell)
        found.append(f'| {section.splitlines()[0]} | {files} | {fitted} | {bodies} | {masses} '
                     f'| {np.median(costs):.2f}, {max(costs):.1f} | {words[0]}, {words[1]} '
                     f'| {asleep} of {len(fell)} |')
    return '\n'.join(found)


if __name__ == '__main__':
    main(sys.argv[1:])
