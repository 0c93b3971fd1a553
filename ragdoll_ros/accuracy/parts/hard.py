"""Hard cases: each is run and checked against its requirements."""
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
from ..cases.hard_cases import hard_cases
from ..cases.trial import SINKING, HardCase, Requirements, Trial
from ..crowds.depth import BoneDepth
from ..methods import by_name, run
from ..metrics import Metrics
from ..results.criteria import EXCESS
from ..results.runner import Job, Row, RunOptions
from ..trajectory import Trajectory

NAME = 'hard'
RESTING = 'rest for 10 min'

WOKEN = 0.1
"""Speed, m/s, that a sleeping doll must exceed after a push or a contact."""
GAP, REST = 1e-3, 0.05
"""Bounds for all cases: joint gap, m; speed at rest, m/s."""

FUZZED, CHUNK, HANG = 200, 10, 5.0
"""Random scenes, scenes per job, and CPU seconds from which a tick counts as hanging."""

LOOSE = Requirements(sinking_m=None, depth_m=None, overshoot_rad=None, rest=False)
"""Requirements of random scenes: no stop, no hang, no NaN, no gap."""

QUICK_CASES = ('mass ratio 1:100', 'start in a self-overlap', 'limits of 2°', 'scale 0.01',
               'hits the ground at 100 m/s', 'spin 20 rad/s', 'limit slams')


def jobs(options: RunOptions, accuracy: str = 'normal') -> list[Job]:
    """Jobs of every case at an accuracy and by PyBullet at N = 10."""
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
    """Run a case by a method: one row; 'faults' lists the requirements that are not met."""
    case = next(case for case in hard_cases() if case.name == name)
    return [checked(case, case.make(), method_name)]


def checked(case: HardCase, trial: Trial, method_name: str) -> Row:
    """Run a trial and check its requirements."""
    result = run(by_name(method_name), trial)
    row: Row = {'case': case.name, 'method': method_name,
                'cpu_s_per_s': float(result.costs.sum() / trial.duration)}
    if not result.trajectory.finite:
        return {**row, 'faults': ['NaN'], 'passed': False}
    row |= figures(case, trial, result.trajectory)
    row |= {'stops': result.measures.get('stopped_total', 0.0),
            'slowest_s': float(result.costs.max())}
    row['faults'] = violations(case, row)
    return {**row, 'passed': not row['faults']}


def fuzz(method_name: str, first: int, end: int) -> list[Row]:
    """Run random scenes first ... end - 1: one row; 'faults' lists the scenes that have any."""
    rows = [checked(HardCase(f'{number}', functools.partial(fuzzed, number), LOOSE),
                   fuzzed(number), method_name) for number in range(first, end)]
    faults = [f'{row["case"]}: {", ".join(row["faults"])}' for row in rows if not row['passed']]
    worst = {key: max(row.get(key, math.inf) for row in rows)
             for key in ('excess', 'gap_m', 'fastest_m_s', 'stops', 'slowest_s')}
    return [{'case': f'fuzzed scenes {first} to {end - 1}', 'method': method_name, **worst,
             'faults': faults, 'passed': not faults}]


def figures(case: HardCase, trial: Trial, trajectory: Trajectory) -> Row:
    """Figures that requirements refer to; names end in their units."""
    metrics = Metrics(trial.scene)
    speeds = np.linalg.norm(trajectory.linear_velocities, axis=-1).max(axis=1)
    lift = (sum(bone.mass for bone in trial.scene.bones) * case.requirements.lift_m
            * float(np.linalg.norm(trial.scene.gravity)))
    moved = np.linalg.norm(trajectory.positions[-1] - trajectory.positions[0], axis=-1)
    recovered = metrics.after_limit_recovery(trajectory)
    inside, depth = BoneDepth(trial.scene).after_separation(recovered)
    return {'excess': metrics.energy_excess(trial, inside, lift),
            'depth_m': depth if case.requirements.depth_m else None,
            'gap_m': metrics.joint_gap(trajectory), 'overshoot_rad': metrics.overshoot(inside),
            'sinking_m': metrics.penetration(trajectory),
            'end_sinking_m': metrics.penetration(trajectory.part(slice(-1, None))),
            'momentum': max(metrics.momentum_drift(trial, trajectory),
                            metrics.angular_momentum_drift(trajectory)),
            'moved_m': float(moved.max()), 'fastest_m_s': float(speeds.max()),
            'end_m_s': float(speeds[-10:].max()), 'settled_s': metrics.settling_time(trajectory)}


def violations(case: HardCase, row: Row) -> list[str]:
    """Names of the requirements that are not met; NaN meets none."""
    required, found = case.requirements, []
    size = max(1.0, case.scale)
    bounds = (('excess', EXCESS, 'energy from nothing'), ('gap_m', GAP * size, 'gap'),
              ('stops', 0.0, 'stopped'), ('slowest_s', HANG, 'hangs'),
              ('overshoot_rad', required.overshoot_rad, 'overshoot'),
              ('sinking_m', required.sinking_m and required.sinking_m * size, 'sinking'),
              ('depth_m', required.depth_m and required.depth_m * size, 'bone in bone'),
              ('end_sinking_m', required.sinking_m and SINKING * size, 'stays sunk'),
              ('momentum', required.max_momentum_drift, 'momentum'),
              ('moved_m', required.max_displacement_m, 'does not stay'),
              ('fastest_m_s', required.max_speed_m_s, 'speed'),
              ('end_m_s', REST * math.sqrt(size) if required.rest else None, 'not at rest'))
    for key, bound, text in bounds:
        if bound is not None and not row[key] <= bound:
            found.append(text)
    return found


def rest(accuracy: str) -> list[Row]:
    """Ten minutes on the ground: settle in 5 s, sleep, wake by a push and by a contact."""
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
    found += ['a touch does not wake it'] * (not _wakes_by_contact(accuracy))
    return [{'case': RESTING, 'method': f'ours-{accuracy}', 'end_m_s': fastest,
             'faults': found, 'passed': not found}]


def _wakes_by_contact(accuracy: str) -> bool:
    """Whether a sleeping doll wakes when hit by a rolling ball of 1 m diameter, after 7.4 s.

    It need not move: under friction without limit the ball may press it onto the ground.
    """
    scene = load_scene('drop')
    ball = Ragdoll('ball', (Bone('ball', Sphere(0.5), 50.0, (0.0, 0.0, 0.0)),))
    rolling = Placement(ball, position=(-45.0, 0.0, 0.5), velocity=(6.0, 0.0, 0.0),
                        spin=(0.0, 12.0, 0.0))
    scene = dataclasses.replace(scene, dolls=(scene.dolls[0], rolling))
    with Simulation(scene, accuracy=accuracy) as simulation:
        asleep = []
        for _ in range(900):
            simulation.advance()
            asleep.append(bool(simulation._engine.sleeping[0]))
    return asleep[700] and not all(asleep[700:])
