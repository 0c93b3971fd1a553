"""The nine classes of random starts: energy gain, overshoot, penetration, and CPU time.

Our settings run many starts of the default scene, whose friction is unlimited, each to rest. In
comparisons all methods run the same few starts at the friction of comparisons.
"""
import dataclasses
import functools
import math

import numpy as np

from ...physics.accuracy import ACCURACIES
from ..cases.comparison import FRICTION, compared
from ..cases.starts import CLASSES, trial
from ..cases.trial import Trial
from ..crowds.depth import BoneDepth
from ..methods import Method, Result, by_name, installed, run
from ..metrics import Metrics
from ..results.criteria import EXCESS
from ..results.runner import Job, Row, RunOptions
from ..trajectory import Trajectory

NAME = 'classes'
COMPARED = 'compared'
RATIOS = 'ratios'
WORST = ('excess', 'overshoot_rad', 'sinking_m', 'depth_m', 'gap_m', 'speed_m_s')

RESTING, REST_SPEED = 15.0, 1e-3
"""Our simulation must be asleep so many s after the trial's end, all bones slower than m/s."""

OURS = tuple(f'ours-{accuracy}' for accuracy in ACCURACIES)

BASELINE = 'bullet-10'
"""Whose CPU time the others' are divided by."""

TIMED = (BASELINE, *OURS, 'bullet-4', 'mujoco-implicitfast-10', 'mujoco-implicitfast-4', 'dart-10',
         'dart-4')

REPEATS, COUNT = 3, 30
"""Runs of each start that is timed; compared starts of each class."""

CHUNK = 10
"""Starts per job."""

OTHERS = ('quickstart', BASELINE, 'bullet-4', 'bullet-20', 'mujoco-implicitfast-10', 'dart-10')

QUICK_CLASSES = ('push .1 to 3 s', 'spin 20 rad/s', 'drop 2 m', 'start outside')


def jobs(options: RunOptions) -> list[Job]:
    """Jobs of our accuracies and the other methods on all classes, and of CPU ratios."""
    made = []
    for name in CLASSES:
        for method in OURS:
            made += chunks(name, method, 2 if options.quick else options.starts)
        for method in (OURS[1], BASELINE) if options.quick else (*OURS, *installed(OTHERS)):
            made += chunks(name, method, 2 if options.quick else min(COUNT, options.starts),
                           COMPARED)
        if not options.quick or name in QUICK_CLASSES:
            made.append(Job(RATIOS, f'CPU, {name}', functools.partial(
                time_class, name, 1 if options.quick else 5), 2 if options.quick else 16,
                timed=True))
    return made


def chunks(class_name: str, method: str, count: int, part: str = NAME) -> list[Job]:
    """Jobs of CHUNK starts each."""
    measure = measure_class if part == NAME else compare_class
    return [Job(part, f'{class_name}, {method}', functools.partial(
        measure, class_name, method, first, min(count, first + CHUNK)),
        weight=0.2 * min(CHUNK, count - first)) for first in range(0, count, CHUNK)]


def measure_class(class_name: str, method_name: str, first: int, end: int) -> list[Row]:
    """Worst figures of starts first ... end - 1 of a class, and whether they come to rest."""
    method, found = by_name(method_name), []
    for number in range(first, end):
        start = trial(class_name, number)
        ticks = len(start.times(method.tick)) - 1
        result = run(method, dataclasses.replace(start, duration=start.duration + RESTING))
        found.append({'number': number, 'restless': restless(result),
                      **figures(start, result, ticks)})
    return [gathered(class_name, method_name, found)]


def compare_class(class_name: str, method_name: str, first: int, end: int) -> list[Row]:
    """Worst figures of starts first ... end - 1 at the friction of comparisons, not followed to
    rest.
    """
    method, found = by_name(method_name), []
    for number in range(first, end):
        start = compared(trial(class_name, number))
        result = run(method, start)
        found.append({'number': number, **figures(start, result, len(result.costs))})
    return [{**gathered(class_name, method_name, found), 'friction': FRICTION}]


def figures(start: Trial, result: Result, ticks: int) -> Row:
    """CPU time and worst figures of the first ``ticks`` of a start."""
    return {'cpu_s': float(result.costs[:ticks].sum()), 'simulated_s': start.duration,
            **worst(start, result.trajectory.part(slice(ticks + 1)))}


def restless(result: Result) -> bool:
    """Whether one of our simulations is not at rest and asleep at the end."""
    speeds = np.linalg.norm(result.trajectory.linear_velocities[-1], axis=-1)
    return not (speeds.max() < REST_SPEED and result.measures['asleep'])


def worst(start: Trial, trajectory: Trajectory) -> dict[str, float]:
    """Worst figures of a trajectory; energy gain, overshoot and bone penetration after the recovery
    of limits and overlaps.
    """
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
    """Aggregate rows of single starts: the worst of each figure, sums, and the number of the start
    with the largest energy gain.
    """
    worst = max(found, key=lambda row: row['excess'])
    return {'class': class_name, 'method': method, 'starts': len(found),
            'bad': sum(not row['excess'] <= EXCESS for row in found),
            'worst_excess': worst['excess'], 'worst_start': worst['number'],
            **{f'worst_{key}': max(row[key] for row in found) for key in WORST[1:]},
            **({'restless': sum(row['restless'] for row in found)} if 'restless' in worst else {}),
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
            if name in ('class', 'method', 'friction', 'worst_start'):
                continue
            old[name] = max(old[name], value) if name.startswith('worst') else old[name] + value
    return list(joined.values())


def time_class(class_name: str, count: int) -> list[Row]:
    """CPU time of stepping by each method over that of the baseline.

    Methods alternate. Each tick counts with its least cost of REPEATS runs, which excludes the
    load of other processes.
    """
    methods = [by_name(name) for name in installed(TIMED)]
    sums = {method.name: np.zeros(2) for method in methods}
    for number in range(count):
        start = compared(trial(class_name, number))
        for method, costs in zip(methods, least_costs(methods, start), strict=True):
            sums[method.name] += costs
    base = sums[BASELINE][0]
    return [{'class': class_name, 'method': method.name, 'label': method.label,
             'friction': FRICTION, 'starts': count, 'cpu_s': float(stepping),
             'reading_s': float(reading), 'ratio': float(stepping / base)}
            for method in methods for stepping, reading in [sums[method.name]]]


def least_costs(methods: list[Method], start: Trial) -> list[tuple[float, float]]:
    """CPU time, s, of stepping and reading by each method; of each tick the least of all runs."""
    rounds = [[run(method, start) for method in methods] for _ in range(REPEATS)]
    return [tuple(float(np.min([getattr(result, name) for result in results], axis=0).sum())
                  for name in ('costs', 'reading')) for results in zip(*rounds, strict=True)]
