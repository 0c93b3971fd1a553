"""CPU time of a tick of scenes, us, least of several runs: for two versions in turn. With --starts,
the mean over so many random velocities of the first doll: a change of the last bits of a solve
changes the rest of a fall.

for i in 1 2 3; do for tree in BEFORE AFTER; do (cd $tree; python test/pair_cost.py drop); done
done
"""
from __future__ import annotations

import argparse
import dataclasses
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model.scene import Scene
from ragdoll_ros.physics.accuracy import ACCURACIES
from ragdoll_ros.physics.simulation import Simulation

RUNS, TICKS = 6, 250


def thrown(scene: Scene, seed: int) -> Scene:
    """The scene with up to 1 m/s and 1 rad/s more of its first doll, along each axis."""
    draw, first = np.random.default_rng(seed), scene.dolls[0]
    first = dataclasses.replace(first, velocity=tuple(first.velocity + draw.uniform(-1, 1, 3)),
                                spin=tuple(first.spin + draw.uniform(-1, 1, 3)))
    return dataclasses.replace(scene, dolls=(first, *scene.dolls[1:]))


def cost(scene: Scene, accuracy: str, runs: int) -> float:
    """Least CPU time of a tick, s, of runs from the start, awake."""
    awake, least = dataclasses.replace(ACCURACIES[accuracy], sleep=False), float('inf')
    with Simulation(scene, accuracy=awake) as simulation:
        for _ in range(runs):
            simulation.reset()
            begun = time.process_time()
            for _ in range(TICKS):
                simulation.advance()
            least = min(least, (time.process_time() - begun) / TICKS)
    return least


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('scenes', nargs='+', metavar='SCENE')
    parser.add_argument('--accuracy', choices=list(ACCURACIES), default='draft')
    parser.add_argument('--starts', type=int, default=0, metavar='N',
                        help='mean over so many random velocities of the first doll')
    options = parser.parse_args()
    for name in options.scenes:
        scene = load_scene(name)
        costs = [cost(thrown(scene, seed), options.accuracy, 2) for seed in range(options.starts)]
        mean = np.mean(costs) if costs else cost(scene, options.accuracy, RUNS)
        print(f'{1e6 * mean:10.1f} us  {name}', flush=True)
