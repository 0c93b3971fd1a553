"""CPU time of a tick of scenes, us, least of several runs: for two versions in turn.

for i in 1 2 3; do for tree in BEFORE AFTER; do (cd $tree; python test/pair_cost.py drop); done
done
"""
from __future__ import annotations

import argparse
import dataclasses
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.physics.accuracy import ACCURACIES
from ragdoll_ros.physics.simulation import Simulation

RUNS, TICKS = 6, 250


def cost(scene: str, accuracy: str) -> float:
    """Least CPU time of a tick, s, of runs from the start, awake."""
    awake, least = dataclasses.replace(ACCURACIES[accuracy], sleep=False), float('inf')
    with Simulation(load_scene(scene), accuracy=awake) as simulation:
        for _ in range(RUNS):
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
    options = parser.parse_args()
    for name in options.scenes:
        print(f'{1e6 * cost(name, options.accuracy):10.1f} us  {name}', flush=True)
