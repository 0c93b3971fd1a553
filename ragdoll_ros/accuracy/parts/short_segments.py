"""Short segments of drops of the default doll, each restarted from an instant of a reference run.

Impacts are chaotic, so a long run says little about a method. After Erez, Tassa and Todorov (ICRA
2015): take many instants of a trajectory, run each method for 0.1 s from there, and compare with a
reference from the same state. They compared each engine with itself; here the error is against one
reference for all, and self-convergence and joint gaps are given in addition.
"""
import dataclasses
import functools

import numpy as np

from ...model.coordinates import GeneralizedState
from ...physics.accuracy import ACCURACIES
from ..cases.comparison import LAWS, Law, drop_scene
from ..cases.trial import Trial
from ..methods import (
    Method,
    bullet,
    by_name,
    dart,
    drake,
    installed,
    mujoco,
    reference,
    run,
    start_simulation,
)
from ..metrics import Metrics, compare
from ..results.runner import Job, Row, RunOptions
from ..trajectory import Trajectory

NAME = 'pieces'
LENGTH = 0.1
"""s"""

FINEST_SUBSTEPS, REFINEMENT = 128, 100
"""Substeps of the other engines at their finest; step of `normal` over the reference's."""

SUBSTEPS, DEAR_SUBSTEPS = (1, 2, 4, 10, 16, 32, 100), (1, 4, 10, 32)
"""Of other engines, and of Drake, whose steps take longest."""

FIRST, LAST = 0.25, 1.3
"""s: segments begin between these, from before the first contact until the doll lies still."""


def jobs(options: RunOptions) -> list[Job]:
    """One timed job for each law and method."""
    count = 6 if options.quick else 60
    return [Job(NAME, f'pieces, e = {law.restitution:g}, µ = {law.friction:g}, {name}',
                functools.partial(measure, name, count, law), weight=0.1 * count, timed=True)
            for law in LAWS for name in names(law, options.quick)]


def names(law: Law, quick: bool) -> list[str]:
    """Methods that are compared; Drake has no restitution."""
    counts = dict.fromkeys(('bullet', 'mujoco-implicitfast', 'dart'), SUBSTEPS)
    if not law.restitution:
        counts['drake'] = DEAR_SUBSTEPS
    return [*(f'ours-{accuracy}' for accuracy in ACCURACIES),
            *installed(f'{family}-{n}' for family, fixed in counts.items()
                       for n in ((4, 10) if quick else fixed))]


@functools.cache
def segments(count: int, law: Law) -> list[Trial]:
    """Segments of the drop from ``count`` instants of a run at `exact`."""
    scene, found = drop_scene(law.restitution, law.friction), []
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
    """The engine of a family at its finest; the reference for ours and all other names."""
    return {'PyBullet': bullet(FINEST_SUBSTEPS), 'DART': dart(FINEST_SUBSTEPS),
            'Drake': drake(DEAR_SUBSTEPS[-1]),
            'MuJoCo implicitfast': mujoco('implicitfast', FINEST_SUBSTEPS)}.get(
        family, reference(REFINEMENT))


@functools.cache
def truths(method: str, count: int, law: Law) -> list[Trajectory]:
    """Trajectories of the segments by a method."""
    return [run(by_name(method), trial).trajectory for trial in segments(count, law)]


def measure(name: str, count: int, law: Law) -> list[Row]:
    """Largest error of each segment: median and 90th percentile over all segments."""
    method, found, cpu, reading = by_name(name), [], 0.0, 0.0
    for trial, truth, itself in zip(
            segments(count, law), truths(reference(REFINEMENT).name, count, law),
            truths(finest(method.family).name, count, law), strict=True):
        result = run(method, trial)
        metrics, error = Metrics(trial.scene), compare(result.trajectory, truth)
        found.append((error['position_worst_m'], error['angle_worst_rad'],
                      compare(result.trajectory, itself)['position_worst_m'],
                      metrics.joint_gap(result.trajectory), metrics.penetration(result.trajectory)))
        cpu += result.costs.sum()
        reading += result.reading.sum()
    errors, angles, owns, gaps, sunk = np.array(found).T
    return [{'method': name, 'label': method.label, 'family': method.family,
             **dataclasses.asdict(law), 'pieces': count,
             'reference': reference(REFINEMENT).label, 'cpu_s_per_s': float(cpu / (count * LENGTH)),
             'reading_s_per_s': float(reading / (count * LENGTH)),
             'position_median_m': float(np.median(errors)),
             'position_p90_m': float(np.percentile(errors, 90)),
             'angle_median_rad': float(np.median(angles)),
             'own_median_m': float(np.median(owns)), 'own_p90_m': float(np.percentile(owns, 90)),
             'gap_worst_m': float(gaps.max()), 'sinking_worst_m': float(sunk.max())}]
