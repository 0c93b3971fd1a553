"""CPU time per tick of scenes, from complex to simple."""
from __future__ import annotations

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
    """Median tick of each scene at `normal`; each tick counts with its least cost of all runs."""
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


def _high(scene: Scene) -> Scene:
    placement = dataclasses.replace(scene.dolls[0], position=(0.0, 0.0, 100.0), spin=(0.3, 0, 0.5))
    return dataclasses.replace(scene, dolls=(placement,))


def _impact() -> np.ndarray:
    """From the first contact on."""
    return _ticks(Simulation(_scene()), skipped=29)


def _lying() -> np.ndarray:
    """At rest on the ground, with sleep disabled."""
    normal = Simulation(_scene())
    awake = dataclasses.replace(normal.accuracy, sleep=False)
    normal.close()
    return _ticks(Simulation(_scene(), accuracy=awake), skipped=400)


def _flight_over_ground() -> np.ndarray:
    return _ticks(Simulation(_high(_scene())))


def _flight() -> np.ndarray:
    return _ticks(Simulation(_high(_scene(ground=None))))


def _flight_without_self_collision() -> np.ndarray:
    return _ticks(Simulation(_high(_scene(ground=None, self_collision=False))))


def _one_bone() -> np.ndarray:
    root = load_scene('drop').dolls[0].doll.root
    doll = Ragdoll('one', (root,))
    return _ticks(Simulation(_high(_scene(ground=None, dolls=(Placement(doll),)))))


def _asleep() -> np.ndarray:
    simulation = Simulation(_scene())
    for _ in range(3000):
        if simulation.asleep:
            break
        simulation.advance()
    return _ticks(simulation)


SCENES: tuple[tuple[str, Callable[[], np.ndarray]], ...] = (
    ('falling onto the ground, the second after the first touch', _impact),
    ('lying on the ground, on all bones, kept awake', _lying),
    ('in flight, 100 m over the ground', _flight_over_ground), ('in flight, no ground', _flight),
    ('in flight, no ground, no self-collision', _flight_without_self_collision),
    ('one bone in flight, no ground', _one_bone), ('asleep on the ground', _asleep))
