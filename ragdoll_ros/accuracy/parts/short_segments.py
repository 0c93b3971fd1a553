"""Short segments of drops of the default doll, each restarted from an instant of a run at `exact`.

Impacts are chaotic, so a long run says little about a method. After Erez, Tassa and Todorov (ICRA
2015): take many instants of a trajectory, run each method for 0.1 s from there, and compare with a
reference from the same state. They compared each engine with itself; here the error is against one
reference for all, and self-convergence and joint gaps are given in addition.

Segments of one drop share its impacts: from one drop to another, the 90th percentile of sixty
errors differs by a factor of three. So a few are taken from each of many drops.
"""
import dataclasses
import functools

import numpy as np

from ...model.coordinates import GeneralizedState
from ...model.scene import Scene
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

SEGMENTS_PER_DROP = 4
"""One from each quarter of the time between FIRST and LAST."""

PUSH = 0.05
"""m/s and rad/s: standard deviation of each component of the root's twist at a drop's start."""

RESAMPLES = 1000
"""Of the bootstrap that gives standard errors."""


def jobs(options: RunOptions) -> list[Job]:
    """One timed job for each law and method."""
    drops = 2 if options.quick else 60
    return [Job(NAME, f'pieces, e = {law.restitution:g}, µ = {law.friction:g}, {name}',
                functools.partial(measure, name, drops, law), weight=0.16 * drops, timed=True)
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
def segments(drops: int, law: Law) -> list[Trial]:
    """Segments of drops at `exact`, SEGMENTS_PER_DROP from each, in the order of the drops."""
    scene = drop_scene(law.restitution, law.friction)
    return [Trial(scene, LENGTH, state) for drop in range(drops)
            for state in drop_states(scene, drop)]


def drop_states(scene: Scene, drop: int) -> list[GeneralizedState]:
    """States at random instants of one drop, whose root starts with a small random twist."""
    rng, found = np.random.default_rng(drop), []
    with start_simulation(Trial(scene, LAST), 'exact') as simulation:
        start = copied(simulation.coordinates)
    start.v[:6] += rng.normal(0.0, PUSH, 6)
    bounds = np.rint(np.linspace(FIRST, LAST, SEGMENTS_PER_DROP + 1) / scene.step).astype(int)
    wanted = set(rng.integers(bounds[:-1], bounds[1:]).tolist())
    with start_simulation(Trial(scene, LAST, start), 'exact') as simulation:
        for tick in range(max(wanted) + 1):
            if tick in wanted:
                found.append(copied(simulation.coordinates))
            simulation.advance()
    return found


def copied(coordinates: GeneralizedState) -> GeneralizedState:
    """A copy of coordinates, which later steps of the simulation do not change."""
    return GeneralizedState(coordinates.q.copy(), coordinates.v.copy())


def finest(family: str) -> Method:
    """The engine of a family at its finest; the reference for ours and all other names."""
    return {'PyBullet': bullet(FINEST_SUBSTEPS), 'DART': dart(FINEST_SUBSTEPS),
            'Drake': drake(DEAR_SUBSTEPS[-1]),
            'MuJoCo implicitfast': mujoco('implicitfast', FINEST_SUBSTEPS)}.get(
        family, reference(REFINEMENT))


@functools.cache
def truths(method: str, drops: int, law: Law) -> list[Trajectory]:
    """Trajectories of the segments by a method."""
    return [run(by_name(method), trial).trajectory for trial in segments(drops, law)]


def measure(name: str, drops: int, law: Law) -> list[Row]:
    """Largest error of each segment: median and 90th percentile over all segments."""
    method, found, cpu, reading = by_name(name), [], 0.0, 0.0
    for trial, truth, itself in zip(
            segments(drops, law), truths(reference(REFINEMENT).name, drops, law),
            truths(finest(method.family).name, drops, law), strict=True):
        result = run(method, trial)
        metrics, error = Metrics(trial.scene), compare(result.trajectory, truth)
        found.append((error['position_worst_m'], error['angle_worst_rad'],
                      compare(result.trajectory, itself)['position_worst_m'],
                      metrics.joint_gap(result.trajectory), metrics.penetration(result.trajectory)))
        cpu += result.costs.sum()
        reading += result.reading.sum()
    errors, angles, owns, gaps, sunk = np.array(found).T
    simulated = len(found) * LENGTH
    median, most = standard_errors(errors)
    return [{'method': name, 'label': method.label, 'family': method.family,
             **dataclasses.asdict(law), 'pieces': len(found), 'drops': drops,
             'reference': reference(REFINEMENT).label, 'cpu_s_per_s': float(cpu / simulated),
             'reading_s_per_s': float(reading / simulated),
             'position_median_m': float(np.median(errors)),
             'position_p90_m': float(np.percentile(errors, 90)),
             'position_median_se_m': median, 'position_p90_se_m': most,
             'angle_median_rad': float(np.median(angles)),
             'own_median_m': float(np.median(owns)), 'own_p90_m': float(np.percentile(owns, 90)),
             'gap_worst_m': float(gaps.max()), 'sinking_worst_m': float(sunk.max())}]


def standard_errors(errors: np.ndarray) -> tuple[float, float]:
    """Standard errors of median and 90th percentile, by a bootstrap that draws whole drops."""
    by_drop = errors.reshape(-1, SEGMENTS_PER_DROP)
    chosen = np.random.default_rng(0).integers(0, len(by_drop), (RESAMPLES, len(by_drop)))
    drawn = by_drop[chosen].reshape(RESAMPLES, -1)
    median, most = np.percentile(drawn, (50, 90), axis=1).std(axis=1)
    return float(median), float(most)
