"""The scene `pile` by several engines: what a tick costs, how deep bones sink, when all lie still.

Depths are told of all engines by one scale that moves none of them: MuJoCo's distances, and the
shapes' own heights over the ground.
"""
from __future__ import annotations

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
from ...physics.ground_heights import GroundHeights
from ...physics.simulation import Simulation
from .depth import BoneDepth

DURATION = 10.0
"""s from the start."""

HALF_SECOND = 50
"""Ticks."""

LOOKS = 10
"""Ticks from one look at the depths to the next; limits are looked at each tick."""

PATIENCE = 120.0
"""s on the wall, after which a run is ended where it is."""

RUNAWAY = 100.0
"""m/s: what falls from 6 m has a tenth of it; a run with a faster bone has exploded."""


class RungeKutta(MujocoEngine):
    """MuJoCo by its integrator of order 4, which lets fewer limbs spin up than the others."""

    def __init__(self, scene: Scene, accuracy: Accuracy, *, workers: int = 1) -> None:
        super().__init__(scene, accuracy, 'rk4', workers=workers)


class Ended(Exception):
    """A run is not worth going on with."""


@dataclass
class Outcome:
    """What one engine made of the pile."""

    costs: list[float] = field(default_factory=list)
    """Of each tick, s on the wall."""
    cpu: float = 0.0
    """Of all ticks together, s of processors."""
    between: float = 0.0
    """Deepest of bones in each other, m."""
    sunk: float = 0.0
    """Deepest below the ground, m."""
    past: float = 0.0
    """Farthest past a joint's limit, rad."""
    asleep: float = math.inf
    """s after which nothing moved any more."""
    ended: str = ''
    """Why it ended early."""

    def row(self) -> str:
        """As HEAD has it."""
        ms = 1e3 * np.array(self.costs)
        halves = [part.mean() for part in np.split(ms, range(HALF_SECOND, len(ms), HALF_SECOND))]
        still = f'{self.asleep:.1f}' if self.asleep < math.inf else 'no'
        return (f'{1e3 * self.cpu / len(ms):9.1f}{ms.mean():9.1f}{max(halves):9.1f}'
                f'{np.percentile(ms, 99):9.1f}'
                f'{1e3 * self.between:10.2f}{1e3 * self.sunk:10.2f}{math.degrees(self.past):9.2f}'
                f'{still:>8}  {self.ended}')


HEAD = (f'{"ms a tick, depths in mm":30}{"CPU":>9}{"mean":>9}{"worst":>9}{"p99":>9}'
        f'{"bones":>10}{"ground":>10}{"past, °":>9}{"asleep":>8}')
"""Of a tick the CPU; on the wall the mean, the worst half second, the 99th percentile."""


def watched(scene: Scene, scale: BoneDepth, advance: Callable[[], State],
            past: Callable[[], float]) -> Outcome:
    """Take a scene on for DURATION; ``advance`` goes a tick, ``past`` tells of limits, rad."""
    outcome, heights = Outcome(), GroundHeights(scene)
    try:
        for tick in range(round(DURATION / scene.step)):
            used, begin = time.process_time(), time.perf_counter()
            state = advance()
            outcome.costs.append(time.perf_counter() - begin)
            outcome.cpu += time.process_time() - used
            _look(outcome, heights, scale, state, tick, scene.step)
            outcome.past = max(outcome.past, past())
            if sum(outcome.costs) > PATIENCE:
                raise Ended(f'ended after {PATIENCE:g} s')
    except Ended as reason:
        outcome.ended = f'{reason}, at {len(outcome.costs) * scene.step:.2f} s'
    return outcome


def _look(outcome: Outcome, heights: GroundHeights, scale: BoneDepth, state: State, tick: int,
          step: float) -> None:
    """Enter what the state after a tick of ``step`` s shows."""
    speeds = np.abs(state.linear_velocities).max()
    if not speeds < RUNAWAY:
        raise Ended('exploded')
    if speeds > 0:
        outcome.asleep = math.inf
    elif outcome.asleep == math.inf:
        outcome.asleep = (tick + 1) * step
    if tick % LOOKS == 0:
        enter_depths(outcome, heights, scale, state)


def enter_depths(outcome: Outcome, heights: GroundHeights, scale: BoneDepth, state: State) -> None:
    """Enter how deep bones are in each other and below the ground."""
    depths = scale.depths(state.positions, state.orientations)
    outcome.between = max(outcome.between, float(depths.max(initial=0.0)))
    outcome.sunk = max(outcome.sunk, -float(heights(state).min()))


def run_pile(scene: Scene, scale: BoneDepth, **how: object) -> Outcome:
    """The outcome by an engine of the package; ``how`` goes to Simulation."""
    with Simulation(scene, **how) as simulation:
        return watched(scene, scale, simulation.advance, lambda: float(
            simulation._engine.layout.past_limits(simulation.coordinates.q).max()))


def pile() -> None:
    """Print a row for each engine."""
    scene = load_scene('pile')
    scale = BoneDepth(scene)
    print(f'\n{len(scene.dolls)} dolls dropped into a heap, {DURATION:g} s\n{HEAD}')
    for accuracy, workers in itertools.product(('draft', 'normal'), (1, 2)):
        outcome = run_pile(scene, scale, engine='rigid', accuracy=accuracy, workers=workers)
        print(f'{f"rigid {accuracy}, workers {workers}":30}{outcome.row()}', flush=True)
    for engine, name in ((MujocoEngine, 'MuJoCo'), (RungeKutta, 'MuJoCo by RK4'),
                         (BulletEngine, 'PyBullet')):
        outcome = run_pile(scene, scale, engine=engine, accuracy='draft')
        print(f'{name + ", 4 substeps":30}{outcome.row()}', flush=True)
