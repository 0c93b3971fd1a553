"""What fitted people cost beside the default doll: CPU us a tick while they fall, and asleep.

`make bench` prints it; `python test/fit_cost.py a.glb b.yaml` measures files of one's own instead.
Each falls a dozen times, spun differently, and the dolls take turns: one fall costs up to half as
much again as another.
"""
from __future__ import annotations

import dataclasses
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import fit_rigs
import numpy as np
import wild_rigs

from ragdoll_ros.files.doll import load_doll
from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.fit.pipeline import fit_character
from ragdoll_ros.fit.reading.character import read_character
from ragdoll_ros.model.ragdoll import Ragdoll
from ragdoll_ros.model.scene import above_ground
from ragdoll_ros.physics.simulation import Simulation

PEOPLE = {'with fingers': (fit_rigs, 'mixamo'), 'of VRM': (fit_rigs, 'vrm'),
          'IK feet': (wild_rigs, 'feet_of_root-smooth'),
          'IK hands and feet': (wild_rigs, 'hands_and_feet_of_nothing-smooth'),
          'a pelvis in halves': (wild_rigs, 'split_pelvis-smooth')}

SPINS = np.random.default_rng(0).normal(size=(12, 3)).tolist()
"""rad/s with which each begins to fall."""

LONGEST = 1000
"""Ticks after which one that is not asleep is left."""


def doll_of(path: str) -> Ragdoll:
    """The doll of a character's file, or one in YAML."""
    if Path(path).suffix in ('.yaml', '.yml'):
        return load_doll(path)
    return fit_character(read_character(Path(path))).doll


def fall(doll: Ragdoll, spin: Sequence[float]) -> tuple[float, float, float]:
    """CPU us a tick until asleep, us a tick asleep, and the seconds until then."""
    scene = above_ground(doll)
    placed = dataclasses.replace(scene.dolls[0], spin=tuple(spin))
    with Simulation(dataclasses.replace(scene, dolls=(placed,))) as simulation:
        begin, ticks = time.process_time(), 0
        while not simulation.asleep and ticks < LONGEST:
            simulation.advance()
            ticks += 1
        fell = (time.process_time() - begin) / ticks * 1e6
        begin = time.process_time()
        for _ in range(LONGEST):
            simulation.advance()
        return fell, (time.process_time() - begin) / LONGEST * 1e6, ticks * scene.step


def main() -> None:
    """Print the table."""
    dolls = {'the default doll': load_scene('drop').dolls[0].doll}
    if len(sys.argv) > 1:
        dolls |= {Path(path).name: doll_of(path) for path in sys.argv[1:]}
    else:
        dolls |= {name: rigs.fitted(rig).doll for name, (rigs, rig) in PEOPLE.items()}
    found = {name: [] for name in dolls}
    for spin in SPINS:
        for name, doll in dolls.items():
            found[name].append(fall(doll, spin))
    print(f'{"us a tick of 10 ms":22}{"bodies":>8}{"falling":>10}{"of the doll":>13}{"asleep":>8}'
          f'{"asleep after s":>16}')
    means = {name: np.mean(falls, axis=0) for name, falls in found.items()}
    for name, (fell, slept, after) in means.items():
        print(f'{name:22}{len(dolls[name].bones):8}{fell:10.0f}'
              f'{fell / means["the default doll"][0]:13.1f}{slept:8.1f}{after:16.1f}')


if __name__ == '__main__':
    main()
