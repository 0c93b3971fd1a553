"""The default drop and a free spin: energy over time, cost in real time, spread over 20 starts."""
from __future__ import annotations

import dataclasses
import functools

import numpy as np

from ...files.doll import load_doll
from ...files.scene import load_scene
from ...model import rotation
from ...model.scene import Placement
from ..measure import Measure
from ..methods import Method, bullet, mujoco, ours, quickstart, run
from ..motions.motion import alone, without_damping, without_limits
from ..runner import Job, Options, Row
from ..trial import Trial, posed

NAME = 'energy'
COST = 'real_time'
SPREAD = 'spread'
FINE = 128
"""Substeps of the PyBullet that stands for the truth of the spread."""


def jobs(options: Options) -> list[Job]:
    """Energy over time by three methods; the drop's tick costs; 20 drops that differ a little."""
    made = [Job(NAME, f'energy, {scene}', functools.partial(energies, scene), 3)
            for scene in ('drop', 'spin')]
    made.append(Job(COST, 'the default drop in real time', functools.partial(
        tick_costs, 1 if options.quick else 5), 2 if options.quick else 8, timed=True))
    count = 3 if options.quick else 20
    made += [Job(SPREAD, f'spread, {method.name}', functools.partial(spread, index, count),
                 0.2 * count) for index, method in enumerate(spread_methods())]
    return made


def falling() -> Trial:
    """The default scene, 3 s."""
    return Trial(load_scene('drop'), 3.0)


def spinning() -> Trial:
    """A doll that nothing touches or brakes, spun at 10 rad/s: its energy cannot change."""
    placed = {'spin': tuple(10 * rotation.normalized(np.array((1.0, 2.0, 2.0))))}
    doll = without_limits(without_damping(load_doll('doll')))
    return Trial(alone(doll, (0.0, 0.0, 0.0), **placed), 3.0, posed(Placement(doll, **placed)))


def energies(scene: str) -> list[Row]:
    """Energy as a share of that at the start, at every tick."""
    trial, rows = {'drop': falling, 'spin': spinning}[scene](), []
    for method in (quickstart(), bullet(1), ours('normal')):
        trajectory = run(method, trial).trajectory
        energy = Measure(trial.scene).energy(trajectory)
        rows.append({'scene': scene, 'method': method.name, 'label': method.label,
                     'time_s': trajectory.times.tolist(), 'energy': (energy / energy[0]).tolist()})
    return rows


def tick_costs(repeats: int) -> list[Row]:
    """Cost of the ticks of the default drop, 3 s."""
    rows, trial = [], falling()
    for method in (*map(ours, ('draft', 'normal', 'exact')), bullet(10), bullet(1), quickstart(),
                   mujoco('implicitfast', 10), mujoco('rk4', 4)):
        costs = np.median([run(method, trial).costs for _ in range(repeats)], axis=0)
        tick = method.tick or trial.scene.step
        rows.append({'method': method.name, 'label': method.label, 'tick_s': tick,
                     'cpu_s_per_s': float(costs.sum() / trial.duration),
                     'p50_s': float(np.median(costs)), 'p99_s': float(np.percentile(costs, 99)),
                     'worst_s': float(costs.max()),
                     'over_budget': float((costs > tick).mean())})
    return rows


def spread_methods() -> list[Method]:
    """Methods whose drops are compared as a cloud; the first stands for the truth."""
    return [bullet(FINE), *map(ours, ('draft', 'normal', 'exact')), bullet(10), bullet(1),
            quickstart(), mujoco('implicitfast', 10)]


def spread(method_index: int, count: int) -> list[Row]:
    """Where drops end that begin turned by some thousandths of a radian: the path is chaotic."""
    method, ends = spread_methods()[method_index], []
    masses = np.array([bone.mass for bone in load_scene('drop').bones])
    for number in range(count):
        trial = _tilted(number)
        trajectory = run(method, trial).trajectory
        measure = Measure(trial.scene)
        centre = masses @ trajectory.positions[-1] / masses.sum()
        energy = measure.energy(trajectory)
        ends.append({'settled_s': measure.settling_time(trajectory), 'height_m': float(centre[2]),
                     'way_m': float(np.hypot(*centre[:2])),
                     'energy_left_1s': float(np.interp(1.0, trajectory.times, energy) / energy[0])})
    row: Row = {'method': method.name, 'label': method.label, 'starts': count}
    for key in ('height_m', 'way_m', 'energy_left_1s'):
        values = np.array([end[key] for end in ends])
        row[f'{key}_mean'], row[f'{key}_sd'] = float(values.mean()), float(values.std(ddof=1))
    times = [end['settled_s'] for end in ends if np.isfinite(end['settled_s'])]
    row['settled'] = len(times)
    row['settled_s_median'] = float(np.median(times)) if times else None
    return [row]


def _tilted(number: int) -> Trial:
    rng = np.random.default_rng([20, number])
    scene = load_scene('drop')
    turn = tuple(rotation.from_rotation_vector(rng.normal(size=3) * 5e-3))
    placement = dataclasses.replace(scene.dolls[0], orientation=turn)
    return Trial(dataclasses.replace(scene, dolls=(placement,)), 5.0)
