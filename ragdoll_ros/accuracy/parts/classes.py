"""The nine classes of starts: energy from nothing, overshoot, sinking, and what it costs."""
from __future__ import annotations

import dataclasses
import functools
import math

import numpy as np

from ...physics.settings import ACCURACIES
from ..measure import Measure
from ..methods import Method, bullet, by_name, ours, run
from ..runner import Job, Options, Row
from ..starts import CLASSES, trial
from ..trajectory import Trajectory

NAME = 'classes'
SWITCHES = 'switches'
RATIOS = 'ratios'
ALLOWED = 1e-3
"""Energy excess from which a start counts as bad."""

BASELINE = 10
"""Substeps of the PyBullet that CPU times are compared with."""

REPEATS = 3

CHUNK = 10
"""Starts in one job."""

OTHERS = ('quickstart', f'bullet-{BASELINE}', 'bullet-20', 'mujoco-implicitfast-10')

QUICK_CLASSES = ('push .1 to 3 s', 'spin 20 rad/s', 'drop 2 m', 'start outside')

MECHANISMS: dict[str, dict[str, object]] = {
    'all on': {}, 'no sleep': {'sleep': False}}
"""What is switched off, in words and as fields of Accuracy."""


def jobs(options: Options) -> list[Job]:
    """Our settings and the others on all classes; the mechanisms one by one; the CPU ratios."""
    made = []
    for name in CLASSES:
        for method in [f'ours-{accuracy}' for accuracy in ACCURACIES]:
            made += _chunks(NAME, name, method, 2 if options.quick else options.starts)
        for method in OTHERS[1:2] if options.quick else OTHERS:
            made += _chunks(NAME, name, method, 2 if options.quick else min(30, options.starts))
        if options.quick and name not in QUICK_CLASSES:
            continue
        for mechanism in MECHANISMS:
            made += _chunks(SWITCHES, name, mechanism,
                            1 if options.quick else min(30, options.starts))
        made.append(Job(RATIOS, f'CPU, {name}', functools.partial(
            time_class, name, 1 if options.quick else 5), 2 if options.quick else 16, timed=True))
    return made


def _chunks(part: str, class_name: str, method: str, count: int) -> list[Job]:
    return [Job(part, f'{class_name}, {method}', functools.partial(
        measure_class, class_name, method, first, min(count, first + CHUNK)),
        weight=0.2 * min(CHUNK, count - first)) for first in range(0, count, CHUNK)]


def find(name: str) -> Method:
    """The method of a name, or the normal setting with one mechanism switched off."""
    if name not in MECHANISMS:
        return by_name(name)
    return ours(dataclasses.replace(ACCURACIES['normal'], **MECHANISMS[name]), name)


def measure_class(class_name: str, method_name: str, first: int, end: int) -> list[Row]:
    """Worst figures of the starts first ... end - 1 of a class."""
    found = []
    for number in range(first, end):
        start = trial(class_name, number)
        result = run(find(method_name), start)
        measure = Measure(start.scene)
        found.append({'number': number, 'cpu_s': float(result.costs.sum()),
                      'simulated_s': start.duration,
                      **_worst(measure, start, result.trajectory)})
    return [gathered(class_name, method_name, found)]


def _worst(measure: Measure, start: object, trajectory: Trajectory) -> dict[str, float]:
    if not trajectory.finite:
        return dict.fromkeys(('excess', 'overshoot_rad', 'sinking_m', 'gap_m', 'speed_m_s',
                              'settled_s'), math.inf)
    return {'excess': measure.energy_excess(start, trajectory),
            'overshoot_rad': measure.overshoot(trajectory),
            'sinking_m': measure.sinking(trajectory), 'gap_m': measure.joint_gap(trajectory),
            'speed_m_s': float(np.linalg.norm(trajectory.linear_velocities, axis=-1).max()),
            'settled_s': measure.settling_time(trajectory)}


def gathered(class_name: str, method: str, found: list[Row]) -> Row:
    """One row out of many: the worst of each figure, and the start that has it."""
    worst = max(found, key=lambda row: row['excess'])
    return {'class': class_name, 'method': method, 'starts': len(found),
            'bad': sum(not row['excess'] <= ALLOWED for row in found),
            'worst_excess': worst['excess'], 'worst_start': worst['number'],
            **{f'worst_{key}': max(row[key] for row in found)
               for key in ('overshoot_rad', 'sinking_m', 'gap_m', 'speed_m_s')},
            'settled': sum(row['settled_s'] < math.inf for row in found),
            'cpu_s': sum(row['cpu_s'] for row in found),
            'simulated_s': sum(row['simulated_s'] for row in found)}


def merged(rows: list[Row]) -> list[Row]:
    """One row for each class and method, whose rows came from several jobs."""
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
    """CPU of our settings over that of PyBullet at N = 10, start by start in turn.

    Each run is done REPEATS times, and each of its ticks counts with its least cost: what others
    take of a busy machine is no cost of a method.
    """
    methods = [bullet(BASELINE), *map(ours, ACCURACIES)]
    sums = dict.fromkeys((method.name for method in methods), 0.0)
    for number in range(count):
        start = trial(class_name, number)
        rounds = [[run(method, start).costs for method in methods] for _ in range(REPEATS)]
        for method, costs in zip(methods, zip(*rounds, strict=True), strict=True):
            sums[method.name] += float(np.min(costs, axis=0).sum())
    base = sums[f'bullet-{BASELINE}']
    return [{'class': class_name, 'method': name, 'starts': count, 'cpu_s': value,
             'ratio': value / base} for name, value in sums.items()]
