"""The table of robots in docs/robots.md: what `ragdoll_fit` makes of every URDF of some packages.

python docs/robots.py pybullet_data=FOLDER example-robot-data=FOLDER ... > docs/robots.md

Standard error tells of each robot that is still awake which body moves, and how fast.
"""
from __future__ import annotations

import contextlib
import itertools
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
"""Simulated seconds that a robot falls and lies."""

MANY = 500
"""Files beside each other from which on they share a row."""

HEAD = """# Robots that were fitted

What [`ragdoll_fit`](fit.md#a-robots-urdf) makes of every URDF of some packages on PyPI: the root,
how many bodies, mass, how many warnings the report has, and its [verdict](fit.md#the-verdict);
then, dropped from 0.4 m by the engine `rigid`, the processor time of a tick in the first second,
and after how long it sleeps. For what is refused, the sentence, and whether PyBullet loads it.
Written by `docs/robots.py`.
"""

LOADS = 'import pybullet as p, sys; p.connect(p.DIRECT); p.loadURDF(sys.argv[1])'


def main(arguments: list[str]) -> None:
    """Write the table to standard output."""
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
    """A row for each file, one for all where they are many."""
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
    """What became of one file."""
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
    """Milliseconds a tick in the first second, and when it slept; or why it does not run."""
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


if __name__ == '__main__':
    main(sys.argv[1:])
