"""Energy over time of the default drop and of a free spin; tick costs of the drop."""
from __future__ import annotations

import functools

import numpy as np

from ...files.doll import load_doll
from ...files.scene import load_scene
from ...model import rotation
from ...model.scene import Placement
from ..cases.trial import Trial, posed
from ..methods import bullet, mujoco, ours, quickstart, run
from ..metrics import Metrics
from ..motions.motion import airborne_scene, without_damping, without_limits
from ..results.runner import Job, Row, RunOptions

NAME = 'energy'
COST = 'real_time'


def jobs(options: RunOptions) -> list[Job]:
    """Jobs of energy over time and of the drop's tick costs."""
    made = [Job(NAME, f'energy, {scene}', functools.partial(energies, scene), 3)
            for scene in ('drop', 'spin')]
    made.append(Job(COST, 'the default drop in real time', functools.partial(
        tick_costs, 1 if options.quick else 5), 2 if options.quick else 8, timed=True))
    return made


def falling() -> Trial:
    """The default scene, 3 s."""
    return Trial(load_scene('drop'), 3.0)


def spinning() -> Trial:
    """A doll spun at 10 rad/s without contacts and damping: its energy is constant."""
    placed = {'spin': tuple(10 * rotation.normalized(np.array((1.0, 2.0, 2.0))))}
    doll = without_limits(without_damping(load_doll('doll')))
    return Trial(airborne_scene(doll, (0.0, 0.0, 0.0), **placed), 3.0,
                 posed(Placement(doll, **placed)))


def energies(scene: str) -> list[Row]:
    """Energy relative to that at the start, at every tick, by three methods."""
    trial, rows = {'drop': falling, 'spin': spinning}[scene](), []
    for method in (quickstart(), bullet(1), ours('normal')):
        trajectory = run(method, trial).trajectory
        energy = Metrics(trial.scene).energy(trajectory)
        rows.append({'scene': scene, 'method': method.name, 'label': method.label,
                     'time_s': trajectory.times.tolist(), 'energy': (energy / energy[0]).tolist()})
    return rows


def tick_costs(repeats: int) -> list[Row]:
    """Tick costs of the default drop, 3 s."""
    rows, trial = [], falling()
    for method in (*map(ours, ('draft', 'normal', 'exact')), bullet(10), bullet(4),
                   bullet(1), quickstart(), mujoco('implicitfast', 10),
                   mujoco('implicitfast', 4), mujoco('rk4', 4)):
        costs = np.median([run(method, trial).costs for _ in range(repeats)], axis=0)
        tick = method.tick or trial.scene.step
        rows.append({'method': method.name, 'label': method.label, 'tick_s': tick,
                     'cpu_s_per_s': float(costs.sum() / trial.duration),
                     'p50_s': float(np.median(costs)), 'p99_s': float(np.percentile(costs, 99)),
                     'worst_s': float(costs.max()), 'over_budget': float((costs > tick).mean())})
    return rows
