"""Short pieces of the default drop, each begun anew from a fine reference.

Through impacts two runs part for ever, so a long run says little about a method. After Erez,
Tassa and Todorov (ICRA 2015): take a fine trajectory, begin at many of its instants, run each
method a tenth of a second, and compare with the same engine at its finest from the same state.
They left out how far joints come apart; it stands here beside the error.
"""
from __future__ import annotations

import functools

import numpy as np

from ...files.scene import load_scene
from ...model.coordinates import GeneralizedState
from ...physics.engine.bullet import BulletEngine
from ..measure import Measure, compare
from ..methods import bullet, by_name, mujoco, plain, run
from ..runner import Job, Options, Row
from ..trial import Trial

NAME = 'pieces'
LENGTH = 0.1
"""s"""
FINE = 128
FIRST, LAST = 0.25, 1.3
"""s: instants between which pieces begin: from just before the first touch until it lies still."""


def jobs(options: Options) -> list[Job]:
    """One timed job for each method."""
    count = 6 if options.quick else 25
    fixed = (1, 4, 16) if options.quick else (1, 2, 4, 8, 16, 32)
    names = [f'ours-{accuracy}' for accuracy in ('draft', 'normal', 'exact')]
    names += [f'bullet-{n}' for n in fixed] + [f'mujoco-implicitfast-{n}' for n in fixed]
    names += [f'mujoco-rk4-{n}' for n in fixed]
    return [Job(NAME, f'pieces, {name}', functools.partial(measure, name, count),
                weight=0.04 * count, timed=True) for name in names]


@functools.cache
def beginnings(count: int) -> list[Trial]:
    """Pieces of the default drop at ``count`` instants of a run at FINE substeps."""
    scene = load_scene('drop')
    engine, found = BulletEngine(scene, plain(FINE, scene.step)), []
    wanted = np.rint(np.linspace(FIRST, LAST, count) / scene.step).astype(int)
    for tick in range(wanted[-1] + 1):
        if tick in wanted:
            here = engine.coordinates
            found.append(Trial(scene, LENGTH, GeneralizedState(here.q, here.v)))
        engine.advance(scene.step)
    engine.close()
    return found


@functools.cache
def truths(family: str, count: int) -> list:
    """The same pieces by the engine itself at its finest."""
    method = mujoco('implicitfast', FINE) if family.startswith('MuJoCo') else bullet(FINE)
    return [run(method, trial).trajectory for trial in beginnings(count)]


def measure(name: str, count: int) -> list[Row]:
    """Errors at the worst instant of each piece: median and 90th percentile over the pieces."""
    method, errors, turns, gaps, sunk, cpu = by_name(name), [], [], [], [], 0.0
    for trial, truth in zip(beginnings(count), truths(method.family, count), strict=True):
        result = run(method, trial)
        found = compare(result.trajectory, truth)
        errors.append(found['position_worst_m'])
        turns.append(found['angle_worst_rad'])
        scales = Measure(trial.scene)
        gaps.append(scales.joint_gap(result.trajectory))
        sunk.append(scales.sinking(result.trajectory))
        cpu += result.costs.sum()
    return [{'method': name, 'label': method.label, 'family': method.family, 'pieces': count,
             'cpu_s_per_s': float(cpu / (count * LENGTH)),
             'position_median_m': float(np.median(errors)),
             'position_p90_m': float(np.percentile(errors, 90)),
             'angle_median_rad': float(np.median(turns)),
             'gap_worst_m': float(max(gaps)), 'sinking_worst_m': float(max(sunk))}]
