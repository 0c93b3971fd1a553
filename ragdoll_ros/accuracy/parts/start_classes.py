"""The nine classes of random starts: energy gain, overshoot, penetration, and CPU time."""
from __future__ import annotations

import dataclasses
import functools
import math

import numpy as np

from ...physics.accuracy import ACCURACIES
from ..cases.starts import CLASSES, trial
from ..cases.trial import Trial
from ..crowds.depth import BoneDepth
from ..methods import Result, bullet, by_name, ours, run
from ..metrics import Metrics
from ..results.criteria import EXCESS
from ..results.runner import Job, Row, RunOptions
from ..trajectory import Trajectory

NAME = 'classes'
RATIOS = 'ratios'
WORST = ('excess', 'overshoot_rad', 'sinking_m', 'depth_m', 'gap_m', 'speed_m_s')

RESTING, REST_SPEED = 15.0, 1e-3
"""Our simulation must be asleep so many s after the trial's end, all bones slower than m/s."""

BASELINE = 10
"""PyBullet's substeps in the baseline of CPU times."""

CHEAPER = 4
"""PyBullet's substeps in a second baseline: half the cost, equal accuracy on the ground."""

REPEATS = 3

CHUNK = 10
"""Starts per job."""

OTHERS = ('quickstart', f'bullet-{BASELINE}', f'bullet-{CHEAPER}', 'bullet-20',
          'mujoco-implicitfast-10')

QUICK_CLASSES = ('push .1 to 3 s', 'spin 20 rad/s', 'drop 2 m', 'start outside')


def jobs(options: RunOptions) -> list[Job]:
    """Jobs of our accuracies and the other methods on all classes, and of CPU ratios."""
    made = []
    for name in CLASSES:
        for method in [f'ours-{accuracy}' for accuracy in ACCURACIES]:
            made += chunks(name, method, 2 if options.quick else options.starts)
        for method in OTHERS[1:2] if options.quick else OTHERS:
            made += chunks(name, method, 2 if options.quick else min(30, options.starts))
        if not options.quick or name in QUICK_CLASSES:
            made.append(Job(RATIOS, f'CPU, {name}', functools.partial(
                time_class, name, 1 if options.quick else 5), 2 if options.quick else 16,
                timed=True))
    return made


def chunks(class_name: str, method: str, count: int) -> list[Job]:
    """Jobs of CHUNK starts each."""
    return [Job(NAME, f'{class_name}, {method}', functools.partial(
        measure_class, class_name, method, first, min(count, first + CHUNK)),
        weight=0.2 * min(CHUNK, count - first)) for first in range(0, count, CHUNK)]


def measure_class(class_name: str, method_name: str, first: int, end: int) -> list[Row]:
    """Worst figures of starts first ... end - 1 of a class."""
    method, found = by_name(method_name), []
    for number in range(first, end):
        start = trial(class_name, number)
        ticks = len(start.times(method.tick)) - 1
        whole = dataclasses.replace(start, duration=start.duration + RESTING)
        result = run(method, whole if method.family == 'ours' else start)
        found.append({'number': number, 'cpu_s': float(result.costs[:ticks].sum()),
                      'simulated_s': start.duration, 'restless': restless(result),
                      **worst(start, result.trajectory.part(slice(ticks + 1)))})
    return [gathered(class_name, method_name, found)]


def restless(result: Result) -> bool:
    """Whether one of our simulations is not at rest and asleep at the end."""
    if not result.measures:
        return False
    speeds = np.linalg.norm(result.trajectory.linear_velocities[-1], axis=-1)
    return not (speeds.max() < REST_SPEED and result.measures['asleep'])


def worst(start: Trial, trajectory: Trajectory) -> dict[str, float]:
    """Worst figures of a trajectory, most of them after the recovery of limits and overlaps."""
    if not trajectory.finite:
        return dict.fromkeys(WORST, math.inf) | {'settled_s': math.inf}
    metrics = Metrics(start.scene)
    recovered = metrics.after_limit_recovery(trajectory)
    inside, depth = BoneDepth(start.scene).after_separation(recovered)
    return {'excess': metrics.energy_excess(start, inside),
            'overshoot_rad': metrics.overshoot(inside),
            'sinking_m': metrics.penetration(trajectory), 'depth_m': depth,
            'gap_m': metrics.joint_gap(trajectory),
            'speed_m_s': float(np.linalg.norm(trajectory.linear_velocities, axis=-1).max()),
            'settled_s': metrics.settling_time(trajectory)}


def gathered(class_name: str, method: str, found: list[Row]) -> Row:
    """Aggregate rows of single starts: the worst of each figure and the number of its start."""
    worst = max(found, key=lambda row: row['excess'])
    return {'class': class_name, 'method': method, 'starts': len(found),
            'bad': sum(not row['excess'] <= EXCESS for row in found),
            'worst_excess': worst['excess'], 'worst_start': worst['number'],
            **{f'worst_{key}': max(row[key] for row in found) for key in WORST[1:]},
            'restless': sum(row['restless'] for row in found),
            'settled': sum(row['settled_s'] < math.inf for row in found),
            'cpu_s': sum(row['cpu_s'] for row in found),
            'simulated_s': sum(row['simulated_s'] for row in found)}


def merged(rows: list[Row]) -> list[Row]:
    """Aggregate rows of several jobs: one row for each class and method."""
    joined: dict[tuple, Row] = {}
    for row in rows:
        if 'failed' in row:
            joined[(row['job'], len(joined))] = row
            continue
        key = (row['class'], row['method'])
        if key not in joined:
            joined[key] = dict(row)
            continue
        old = joined[key]
        if row['worst_excess'] > old['worst_excess']:
            old['worst_start'] = row['worst_start']
        for name, value in row.items():
            if name in ('class', 'method', 'worst_start'):
                continue
            old[name] = max(old[name], value) if name.startswith('worst') else old[name] + value
    return list(joined.values())


def time_class(class_name: str, count: int) -> list[Row]:
    """CPU time of our accuracies and of PyBullet at N = 4 over that of PyBullet at N = 10.

    Methods alternate. Each tick counts with its least cost of REPEATS runs, which excludes the
    load of other processes.
    """
    methods = [bullet(BASELINE), *map(ours, ACCURACIES), bullet(CHEAPER)]
    sums = dict.fromkeys((method.name for method in methods), 0.0)
    for number in range(count):
        start = trial(class_name, number)
        rounds = [[run(method, start).costs for method in methods] for _ in range(REPEATS)]
        for method, costs in zip(methods, zip(*rounds, strict=True), strict=True):
            sums[method.name] += float(np.min(costs, axis=0).sum())
    base = sums[f'bullet-{BASELINE}']
    return [{'class': class_name, 'method': name, 'starts': count, 'cpu_s': value,
             'ratio': value / base} for name, value in sums.items()]
