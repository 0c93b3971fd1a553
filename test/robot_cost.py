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

CASES = {'doll alone': (None, 0), 'robot of static bodies': ('{}', 0),
         'robot that follows, never told': (', follow: exact', 0),
         'told at 50 Hz': (', follow: exact', 2), 'told each tick, 100 Hz': (', follow: exact', 1)}
"""What the scene's robot has, and every how many ticks it is told."""


def scene(folder: Path, robot: str | None, distance: float) -> Scene:
    """The scene drop, with the robot so many m beside the doll."""
    (folder / 'arm.urdf').write_text(URDF)
    entry = '' if robot is None else (
        f'bodies: [{{name: arm, urdf: arm.urdf, position: [{distance}, 0, 0]{robot.strip("{}")}}}]')
    (folder / 'scene.yaml').write_text(f'ground: {{}}\ndolls: [{{doll: doll}}]\n{entry}\n')
    made = load_scene(str(folder / 'scene.yaml'))
    return dataclasses.replace(load_scene('drop'), bodies=made.bodies, robots=made.robots,
                               dolls=(*load_scene('drop').dolls, *made.dolls[1:]))


COMMANDS = [tuple({name: scale * wave(2 * 0.01 * tick + k) for k, name in enumerate(NAMES)}
                  for scale, wave in ((0.3, math.sin), (0.6, math.cos))) for tick in range(TICKS)]
"""Joint angles and rates of each tick."""


def cost(simulation: Simulation, every: int) -> float:
    """CPU time of a tick, s, from the start."""
    simulation.reset()
    begun = time.process_time()
    for tick, (angles, rates) in enumerate(COMMANDS):
        if every and tick % every == 0:
            simulation.drive_body('arm', joint_angles=angles, rates=rates)
        simulation.advance()
    return (time.process_time() - begun) / TICKS


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--distance', type=float, default=3.0,
                        help='of the robot from the doll, m (default 3: out of its reach)')
    parser.add_argument('--accuracy', choices=list(ACCURACIES), default='normal')
    options = parser.parse_args()
    awake = dataclasses.replace(ACCURACIES[options.accuracy], sleep=True)
    with tempfile.TemporaryDirectory() as folder:
        each = {name: (Simulation(scene(Path(folder), robot, options.distance), accuracy=awake),
                       every) for name, (robot, every) in CASES.items()}
        least = dict.fromkeys(each, math.inf)
        for _ in range(RUNS):
            for name, (simulation, every) in each.items():
                least[name] = min(least[name], cost(simulation, every))
    for name, seconds in least.items():
        print(f'{1e6 * seconds:7.1f} us  {seconds / least["doll alone"]:5.2f}  {name}')


if __name__ == '__main__':
    main()
