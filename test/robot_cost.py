"""CPU time of a tick of a falling doll beside a robot of 8 links, and its ratio to the doll alone.

python test/robot_cost.py
"""
from __future__ import annotations

import argparse
import dataclasses
import math
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model.scene import Scene
from ragdoll_ros.physics.accuracy import ACCURACIES
from ragdoll_ros.physics.simulation import Simulation

RUNS, TICKS, LINKS = 15, 200, 8

NAMES = tuple(f'joint_{k}' for k in range(1, LINKS))

URDF = '<robot name="arm">{}{}</robot>'.format(
    ''.join(f'<link name="link_{k}"><collision><origin xyz="0 0 0.06"/><geometry>'
            f'<box size="0.08 0.08 0.1"/></geometry></collision></link>' for k in range(LINKS)),
    ''.join(f'<joint name="joint_{k}" type="revolute"><parent link="link_{k - 1}"/>'
            f'<child link="link_{k}"/><origin xyz="0 0 0.12"/>'
            f'<axis xyz="{k % 2} {(k + 1) % 2} 0"/><limit lower="-3" upper="3"/></joint>'
            for k in range(1, LINKS)))
"""An arm that stands upright, whose joints turn about x and y by turns."""

ALONE, EACH_TICK = 'doll alone', 'told each tick'
CASES = {ALONE: (None, 0), 'robot of static bodies': ('', 0),
         'robot that follows, never told': (', follow: exact', 0),
         'told every other tick': (', follow: exact', 2), EACH_TICK: (', follow: exact', 1)}
"""What the scene's robot has, and every how many ticks it is told."""

COMMANDS = [tuple({name: scale * wave(0.02 * tick + k) for k, name in enumerate(NAMES)}
                  for scale, wave in ((0.3, math.sin), (0.6, math.cos))) for tick in range(TICKS)]
"""Joint angles and rates of each tick."""


def scene(folder: Path, robot: str | None, distance: float) -> Scene:
    """The scene drop, with the robot so many m beside the doll."""
    drop = load_scene('drop')
    if robot is None:
        return drop
    (folder / 'arm.urdf').write_text(URDF)
    (folder / 'scene.yaml').write_text(
        'ground: {}\ndolls: [{doll: doll}]\nbodies:\n'
        f'  - {{name: arm, urdf: arm.urdf, position: [{distance}, 0, 0]{robot}}}\n')
    made = load_scene(str(folder / 'scene.yaml'))
    return dataclasses.replace(drop, bodies=made.bodies, robots=made.robots,
                               dolls=(*drop.dolls, *made.dolls[1:]))


def cost(simulation: Simulation, every: int) -> float:
    """CPU time of a tick, s, from the start."""
    simulation.reset()
    begun = time.process_time()
    for tick, (angles, rates) in enumerate(COMMANDS):
        if every and tick % every == 0:
            simulation.drive_body('arm', joint_angles=angles, rates=rates)
        simulation.advance()
    return (time.process_time() - begun) / TICKS


def costs(distance: float = 3.0, accuracy: str = 'normal') -> dict[str, float]:
    """CPU time of a tick of each case, s, the least of several runs in turn."""
    with tempfile.TemporaryDirectory() as folder:
        each = {name: (Simulation(scene(Path(folder), robot, distance), accuracy=accuracy), every)
                for name, (robot, every) in CASES.items()}
        least = dict.fromkeys(each, math.inf)
        for _ in range(RUNS):
            for name, (simulation, every) in each.items():
                least[name] = min(least[name], cost(simulation, every))
        return least


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--distance', type=float, default=3.0,
                        help='of the robot from the doll, m (default 3: out of its reach)')
    parser.add_argument('--accuracy', choices=list(ACCURACIES), default='normal')
    found = costs(**vars(parser.parse_args()))
    for name, seconds in found.items():
        print(f'{1e6 * seconds:7.1f} us  {seconds / found[ALONE]:5.2f}  {name}')
