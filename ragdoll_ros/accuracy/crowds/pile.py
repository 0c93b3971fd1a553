"""The scene `pile` by several engines: tick cost, penetration, time until all dolls sleep.

Penetration is measured independently of the engines: by MuJoCo's distance functions, and by the
shapes' heights above the ground.
"""
import itertools
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ...files.scene import load_scene
from ...model.scene import Scene
from ...model.state import State
from ...physics.accuracy import Accuracy
from ...physics.engine.substepped.bullet import BulletEngine
from ...physics.engine.substepped.mujoco import MujocoEngine
from ...physics.rigid_body import GroundHeights
from ...physics.simulation import Simulation
from .depth import BoneDepth

DURATION = 10.0
"""s from the start."""

HALF_SECOND = 50
"""Ticks."""

DEPTH_INTERVAL = 10
"""Ticks between measurements of depths; joint limits are checked every tick."""

MAX_WALL_TIME = 120.0
"""s, after which a run is aborted."""

MAX_SPEED = 100.0
"""m/s: a run with a faster bone has diverged; a fall from 6 m reaches a tenth of it."""


class RungeKutta(MujocoEngine):
    """MuJoCo with its Runge-Kutta integrator of order 4, with which fewer limbs spin up."""

    def __init__(self, scene: Scene, accuracy: Accuracy, *, workers: int = 1) -> None:
        super().__init__(scene, accuracy, 'rk4', workers=workers)


class RunAborted(Exception):
    """A run has diverged or takes too long."""


@dataclass
class Outcome:
    """Results of one engine."""

    costs: list[float] = field(default_factory=list)
    """Wall time of each tick, s."""
    cpu: float = 0.0
    """CPU time of all ticks, s."""
    bone_depth: float = 0.0
    """Largest penetration of bones, m."""
    ground_depth: float = 0.0
    """Largest penetration of the ground, m."""
    overshoot: float = 0.0
    """Largest limit overshoot, rad."""
    asleep: float = math.inf
    """Time, s, after which nothing moves."""
    ended: str = ''
    """Reason of an abort."""

    def row(self) -> str:
        """Line of the table under HEAD."""
        ms = 1e3 * np.array(self.costs)
        halves = [part.mean() for part in np.split(ms, range(HALF_SECOND, len(ms), HALF_SECOND))]
        still = f'{self.asleep:.1f}' if self.asleep < math.inf else 'no'
        return (f'{1e3 * self.cpu / len(ms):9.1f}{ms.mean():9.1f}{max(halves):9.1f}'
                f'{np.percentile(ms, 99):9.1f}'
                f'{1e3 * self.bone_depth:10.2f}{1e3 * self.ground_depth:10.2f}'
                f'{math.degrees(self.overshoot):9.2f}'
                f'{still:>8}  {self.ended}')


HEAD = (f'{"ms a tick, depths in mm":30}{"CPU":>9}{"mean":>9}{"worst":>9}{"p99":>9}'
        f'{"bones":>10}{"ground":>10}{"past, °":>9}{"asleep":>8}')
"""Per tick: CPU time; wall time as mean, worst half second and 99th percentile."""


def measured(scene: Scene, depths: BoneDepth, advance: Callable[[], State],
             overshoot: Callable[[], float]) -> Outcome:
    """Simulate a scene for DURATION and measure it: ``advance`` advances by a tick, ``overshoot``
    returns the largest limit overshoot, rad.
    """
    outcome, heights = Outcome(), GroundHeights(scene)
    try:
        for tick in range(round(DURATION / scene.step)):
            used, begin = time.process_time(), time.perf_counter()
            state = advance()
            outcome.costs.append(time.perf_counter() - begin)
            outcome.cpu += time.process_time() - used
            _record(outcome, heights, depths, state, tick, scene.step)
            outcome.overshoot = max(outcome.overshoot, overshoot())
            if sum(outcome.costs) > MAX_WALL_TIME:
                raise RunAborted(f'aborted after {MAX_WALL_TIME:g} s')
    except RunAborted as reason:
        outcome.ended = f'{reason}, at {len(outcome.costs) * scene.step:.2f} s'
    return outcome


def _record(outcome: Outcome, heights: GroundHeights, depths: BoneDepth, state: State, tick: int,
            step: float) -> None:
    """Record the state after a tick of ``step`` s."""
    speeds = np.abs(state.linear_velocities).max()
    if not speeds < MAX_SPEED:
        raise RunAborted('diverged')
    if speeds > 0:
        outcome.asleep = math.inf
    elif outcome.asleep == math.inf:
        outcome.asleep = (tick + 1) * step
    if tick % DEPTH_INTERVAL == 0:
        record_depths(outcome, heights, depths, state)


def record_depths(outcome: Outcome, heights: GroundHeights, depths: BoneDepth,
                  state: State) -> None:
    """Record the largest penetration of bones and of the ground."""
    found = depths.depths(state.positions, state.orientations)
    outcome.bone_depth = max(outcome.bone_depth, float(found.max(initial=0.0)))
    outcome.ground_depth = max(outcome.ground_depth, -float(heights(state).min()))


def run_pile(scene: Scene, depths: BoneDepth, **options: object) -> Outcome:
    """Simulate a scene; ``options`` are passed to Simulation."""
    with Simulation(scene, **options) as simulation:
        return measured(scene, depths, simulation.advance, lambda: float(
            simulation._engine.layout.limit_violations(simulation.coordinates.q).max()))


def pile() -> None:
    """Print a row for each engine."""
    scene = load_scene('pile')
    depths = BoneDepth(scene)
    print(f'\n{len(scene.dolls)} dolls dropped into a pile, {DURATION:g} s\n{HEAD}')
    for accuracy, workers in itertools.product(('draft', 'normal'), (1, 2)):
        outcome = run_pile(scene, depths, engine='rigid', accuracy=accuracy, workers=workers)
        print(f'{f"rigid {accuracy}, workers {workers}":30}{outcome.row()}', flush=True)
    for engine, name in ((MujocoEngine, 'MuJoCo'), (RungeKutta, 'MuJoCo by RK4'),
                         (BulletEngine, 'PyBullet')):
        outcome = run_pile(scene, depths, engine=engine, accuracy='draft')
        print(f'{name + ", 4 substeps":30}{outcome.row()}', flush=True)
