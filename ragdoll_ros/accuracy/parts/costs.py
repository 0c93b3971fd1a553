"""CPU time per tick of scenes, from complex to simple."""
import dataclasses
import functools
from collections.abc import Callable
from time import process_time

import numpy as np

from ...files.scene import load_scene
from ...model.ragdoll import Ragdoll
from ...model.scene import Placement, Scene
from ...physics.simulation import Simulation
from ..results.runner import Job, Row, RunOptions

NAME = 'costs'
TICKS = 100


def jobs(options: RunOptions) -> list[Job]:
    """One timed job, since the scenes are compared with each other."""
    repeats = 2 if options.quick else 7
    return [Job(NAME, 'what a scene costs', functools.partial(
        measure_all, repeats), repeats, timed=True)]


def measure_all(repeats: int) -> list[Row]:
    """Median and 99th percentile of a tick of each scene at `normal`; each tick counts with its
    least cost of all runs.
    """
    rounds = [[make() for _, make in SCENES] for _ in range(repeats)]
    rows = []
    for (text, _), costs in zip(SCENES, zip(*rounds, strict=True), strict=True):
        ticks = np.min(costs, axis=0)
        rows.append({'scene': text, 'tick_s': float(np.median(ticks)),
                     'tick_p99_s': float(np.percentile(ticks, 99))})
    return rows


def _ticks(simulation: Simulation, skipped: int = 0) -> np.ndarray:
    """CPU time of TICKS ticks, s, after ``skipped`` ones."""
    for _ in range(skipped):
        simulation.advance()
    costs = np.empty(TICKS)
    for index in range(TICKS):
        before = process_time()
        simulation.advance()
        costs[index] = process_time() - before
    simulation.close()
    return costs


def _scene(**changes: object) -> Scene:
    return dataclasses.replace(load_scene('drop'), **changes)


def _lying() -> np.ndarray:
    """Tick costs at rest on the ground, with sleep disabled."""
    normal = Simulation(_scene())
    awake = dataclasses.replace(normal.accuracy, sleep=False)
    normal.close()
    return _ticks(Simulation(_scene(), accuracy=awake), skipped=400)


def _flight(**changes: object) -> np.ndarray:
    """Tick costs at a height of 100 m, in a scene with ``changes``."""
    scene = _scene(**changes)
    placement = dataclasses.replace(scene.dolls[0], position=(0.0, 0.0, 100.0), spin=(0.3, 0, 0.5))
    return _ticks(Simulation(dataclasses.replace(scene, dolls=(placement,))))


def _one_bone() -> np.ndarray:
    root = load_scene('drop').dolls[0].doll.root
    return _flight(ground=None, dolls=(Placement(Ragdoll('one', (root,))),))


def _asleep() -> np.ndarray:
    simulation = Simulation(_scene())
    for _ in range(3000):
        if simulation.asleep:
            break
        simulation.advance()
    return _ticks(simulation)


SCENES: tuple[tuple[str, Callable[[], np.ndarray]], ...] = (
    ('falling onto the ground, the second after the first touch',
     lambda: _ticks(Simulation(_scene()), skipped=29)),
    ('lying on the ground, on all bones, kept awake', _lying),
    ('in flight, 100 m over the ground', _flight),
    ('in flight, no ground', lambda: _flight(ground=None)),
    ('in flight, no ground, no self-collision',
     lambda: _flight(ground=None, self_collision=False)),
    ('one bone in flight, no ground', _one_bone), ('asleep on the ground', _asleep))
