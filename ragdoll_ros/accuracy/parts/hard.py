"""Hard cases: each is run and held against its rule."""
from __future__ import annotations

import dataclasses
import functools
import math

import numpy as np

from ...files.scene import load_scene
from ...model.push import Push
from ...model.ragdoll import Bone, Ragdoll
from ...model.scene import Placement
from ...model.shapes import Sphere
from ...physics.simulation import Simulation
from ..cases.fuzzed import fuzzed
from ..cases.hard_case import SINKING, HardCase, Requirements
from ..cases.hard_cases import hard_cases
from ..cases.trial import Trial
from ..crowds.depth import BoneDepth
from ..methods import by_name, run
from ..metrics import Metrics
from ..results.criteria import EXCESS
from ..results.runner import Job, Row, RunOptions
from ..trajectory import Trajectory

NAME = 'hard'
RESTING = 'rest for 10 min'

WOKEN = 0.1
"""m/s that a doll reaches which is pushed or touched in its sleep; what sleeps has none."""
GAP, REST = 1e-3, 0.05
"""m between the ends of a joint, m/s: more breaks every rule."""

FUZZED, CHUNK, HANG = 200, 10, 5.0
"""Random scenes, as many in a job, and the CPU seconds from which a tick counts as hanging."""

LOOSE = Requirements(sinking_m=None, depth_m=None, overshoot_rad=None, rest=False)
"""For random scenes: no stop, no hang, no NaN, no gap."""

QUICK_CASES = ('mass ratio 1:100', 'start in a self-overlap', 'limits of 2°', 'scale 0.01',
               'hits the ground at 100 m/s', 'spin 20 rad/s', 'limit slams')


def jobs(options: RunOptions, accuracy: str = 'normal') -> list[Job]:
    """Every case at a setting, and beside it PyBullet at N = 10."""
    made = []
    for case in hard_cases():
        if options.quick and case.name not in QUICK_CASES:
            continue
        for method in (f'ours-{accuracy}', *(() if options.quick else ('bullet-10',))):
            weight = 200 if 'pile' in case.name else 3
            made.append(Job(NAME, f'{case.name}, {method}', functools.partial(
                measure, case.name, method), weight))
    made.append(Job(NAME, RESTING, functools.partial(rest, accuracy), 4))
    for first in range(0, CHUNK if options.quick else FUZZED, CHUNK):
        made.append(Job(NAME, f'fuzzed scenes from {first}', functools.partial(
            fuzz, f'ours-{accuracy}', first, first + CHUNK), CHUNK))
    return made


def measure(name: str, method_name: str) -> list[Row]:
    """A case run by a method: one row. What of its rule does not hold is its published 'faults'."""
    case = next(case for case in hard_cases() if case.name == name)
    return [judged(case, case.make(), method_name)]


def judged(case: HardCase, trial: Trial, method_name: str) -> Row:
    """The row of a trial by a method."""
    result = run(by_name(method_name), trial)
    row: Row = {'case': case.name, 'method': method_name,
                'cpu_s_per_s': float(result.costs.sum() / trial.duration)}
    if not result.trajectory.finite:
        return {**row, 'faults': ['NaN'], 'passed': False}
    row |= figures(case, trial, result.trajectory)
    row |= {'stops': result.told.get('stopped_total', 0.0), 'slowest_s': float(result.costs.max())}
    row['faults'] = violations(case, row)
    return {**row, 'passed': not row['faults']}


def fuzz(method_name: str, first: int, end: int) -> list[Row]:
    """Random scenes first ... end - 1, one row: 'faults' names the scenes that have any."""
    rows = [judged(HardCase(f'{number}', functools.partial(fuzzed, number), LOOSE),
                   fuzzed(number), method_name) for number in range(first, end)]
    faults = [f'{row["case"]}: {", ".join(row["faults"])}' for row in rows if not row['passed']]
    worst = {key: max(row.get(key, math.inf) for row in rows)
             for key in ('excess', 'gap_m', 'fastest_m_s', 'stops', 'slowest_s')}
    return [{'case': f'fuzzed scenes {first} to {end - 1}', 'method': method_name, **worst,
             'faults': faults, 'passed': not faults}]


def figures(case: HardCase, trial: Trial, trajectory: Trajectory) -> Row:
    """Figures the rules are about; names end in their units."""
    measure = Metrics(trial.scene)
    speeds = np.linalg.norm(trajectory.linear_velocities, axis=-1).max(axis=1)
    lift = (sum(bone.mass for bone in trial.scene.bones) * case.rule.lift_m
            * float(np.linalg.norm(trial.scene.gravity)))
    moved = np.linalg.norm(trajectory.positions[-1] - trajectory.positions[0], axis=-1)
    inside, depth = BoneDepth(trial.scene).since_apart(measure.after_limit_recovery(trajectory))
    return {'excess': measure.energy_excess(trial, inside, lift),
            'depth_m': depth if case.rule.depth_m else None,
            'gap_m': measure.joint_gap(trajectory), 'overshoot_rad': measure.overshoot(inside),
            'sinking_m': measure.sinking(trajectory),
            'end_sinking_m': measure.sinking(trajectory.part(slice(-1, None))),
            'momentum': max(measure.momentum_drift(trial, trajectory),
                            measure.angular_momentum_drift(trajectory)),
            'moved_m': float(moved.max()), 'fastest_m_s': float(speeds.max()),
            'end_m_s': float(speeds[-10:].max()), 'settled_s': measure.settling_time(trajectory)}


def violations(case: HardCase, row: Row) -> list[str]:
    """What of a case's rule does not hold, in words; NaN holds no rule."""
    rule, found = case.rule, []
    size = max(1.0, case.scale)
    bounds = (('excess', EXCESS, 'energy from nothing'), ('gap_m', GAP * size, 'gap'),
              ('stops', 0.0, 'stopped'), ('slowest_s', HANG, 'hangs'),
              ('overshoot_rad', rule.overshoot_rad, 'overshoot'),
              ('sinking_m', rule.sinking_m and rule.sinking_m * size, 'sinking'),
              ('depth_m', rule.depth_m and rule.depth_m * size, 'bone in bone'),
              ('end_sinking_m', rule.sinking_m and SINKING * size, 'stays sunk'),
              ('momentum', rule.max_momentum_drift, 'momentum'),
              ('moved_m', rule.max_displacement_m, 'does not stay'),
              ('fastest_m_s', rule.max_speed_m_s, 'speed'),
              ('end_m_s', REST * math.sqrt(size) if rule.rest else None, 'not at rest'))
    for key, bound, text in bounds:
        if bound is not None and not row[key] <= bound:
            found.append(text)
    return found


def rest(accuracy: str) -> list[Row]:
    """Ten minutes on the ground: settle in 5 s, stand, sleep, wake by push and by touch."""
    found, fastest = [], 0.0
    with Simulation(load_scene('drop'), accuracy=accuracy) as simulation:
        settled = math.inf
        for tick in range(60_000):
            speed = float(np.abs(simulation.advance().linear_velocities).max())
            if tick == 500:
                settled = speed
            if tick > 500:
                fastest = max(fastest, speed)
        found += ['not settled in 5 s'] * (settled > REST)
        found += ['moves after 5 s'] * (fastest > 1e-3)
        found += ['does not sleep'] * (not simulation.asleep)
        simulation.push(Push('head', (0.0, 0.0, 300.0), duration=0.1))
        speed = max(float(np.abs(simulation.advance().linear_velocities).max()) for _ in range(10))
        found += ['a push does not wake it'] * (not speed > WOKEN)
    found += ['a touch does not wake it'] * (not _wakes_by_touch(accuracy))
    return [{'case': RESTING, 'method': f'ours-{accuracy}', 'end_m_s': fastest,
             'faults': found, 'passed': not found}]


def _wakes_by_touch(accuracy: str) -> bool:
    """A doll that has stood, toppled and lain is hit by a ball, 1 m wide, that rolls up (7.4 s)."""
    scene = load_scene('drop')
    ball = Ragdoll('ball', (Bone('ball', Sphere(0.5), 50.0, (0.0, 0.0, 0.0)),))
    rolling = Placement(ball, position=(-45.0, 0.0, 0.5), velocity=(6.0, 0.0, 0.0),
                        spin=(0.0, 12.0, 0.0))
    scene = dataclasses.replace(scene, dolls=(scene.dolls[0], rolling))
    with Simulation(scene, accuracy=accuracy) as simulation:
        speeds = [float(np.abs(simulation.advance().linear_velocities[:-1]).max())
                  for _ in range(900)]
    return speeds[700] < REST and max(speeds[701:]) > WOKEN
