"""Short pieces of the default drop, each begun anew at an instant of a run of it.

Through impacts two runs part for ever, so a long run says little about a method. After Erez,
Tassa and Todorov (ICRA 2015): take many instants of a trajectory, run each method a tenth of a
second from there, and compare with a reference from the same state. They compared each engine with
itself; here that stands beside the difference to one reference for all. They left out how far
joints come apart; it stands here too.
"""
from __future__ import annotations

import functools

import numpy as np

from ...files.scene import load_scene
from ...model.coordinates import GeneralizedState
from ...physics.accuracy import ACCURACIES
from ..cases.trial import Trial
from ..methods import Method, bullet, by_name, mujoco, reference, run, start_simulation
from ..metrics import Metrics, compare
from ..results.runner import Job, Row, RunOptions
from ..trajectory import Trajectory

NAME = 'pieces'
LENGTH = 0.1
"""s"""

FINE, PARTS = 128, 100
"""Substeps of PyBullet and MuJoCo at their finest; parts of normal's step that the reference's
is."""

FIRST, LAST = 0.25, 1.3
"""s: instants between which pieces begin: from just before the first touch until it lies still."""


def jobs(options: RunOptions) -> list[Job]:
    """One timed job for each method."""
    count = 6 if options.quick else 60
    fixed = (4, 10) if options.quick else (1, 2, 4, 10, 16, 32)
    names = [f'ours-{accuracy}' for accuracy in ACCURACIES]
    names += [f'bullet-{n}' for n in fixed] + [f'mujoco-implicitfast-{n}' for n in fixed]
    return [Job(NAME, f'pieces, {name}', functools.partial(measure, name, count),
                weight=0.04 * count, timed=True) for name in names]


@functools.cache
def beginnings(count: int) -> list[Trial]:
    """Pieces of the default drop at ``count`` instants of a run at exact."""
    scene, found = load_scene('drop'), []
    wanted = np.rint(np.linspace(FIRST, LAST, count) / scene.step).astype(int)
    states = {}
    with start_simulation(Trial(scene, LAST), 'exact') as simulation:
        for tick in range(wanted[-1] + 1):
            here = simulation.coordinates
            states[tick] = GeneralizedState(here.q.copy(), here.v.copy())
            simulation.advance()
    for tick in wanted:
        found.append(Trial(scene, LENGTH, states[tick]))
    return found


def finest(family: str) -> Method:
    """An engine at its finest; for ours, and any other name, the reference."""
    return {'PyBullet': bullet(FINE), 'MuJoCo implicitfast': mujoco('implicitfast', FINE)}.get(
        family, reference(PARTS))


@functools.cache
def truths(method: str, count: int) -> list[Trajectory]:
    """The pieces by a method."""
    return [run(by_name(method), trial).trajectory for trial in beginnings(count)]


def measure(name: str, count: int) -> list[Row]:
    """Errors at the worst instant of each piece: median and 90th percentile over the pieces."""
    method, found, cpu = by_name(name), [], 0.0
    for trial, truth, itself in zip(
            beginnings(count), truths(reference(PARTS).name, count),
            truths(finest(method.family).name, count), strict=True):
        result = run(method, trial)
        scales, error = Metrics(trial.scene), compare(result.trajectory, truth)
        found.append((error['position_worst_m'], error['angle_worst_rad'],
                      compare(result.trajectory, itself)['position_worst_m'],
                      scales.joint_gap(result.trajectory), scales.sinking(result.trajectory)))
        cpu += result.costs.sum()
    errors, angles, owns, gaps, sunk = np.array(found).T
    return [{'method': name, 'label': method.label, 'family': method.family, 'pieces': count,
             'reference': reference(PARTS).label, 'cpu_s_per_s': float(cpu / (count * LENGTH)),
             'position_median_m': float(np.median(errors)),
             'position_p90_m': float(np.percentile(errors, 90)),
             'angle_median_rad': float(np.median(angles)),
             'own_median_m': float(np.median(owns)), 'own_p90_m': float(np.percentile(owns, 90)),
             'gap_worst_m': float(gaps.max()), 'sinking_worst_m': float(sunk.max())}]
