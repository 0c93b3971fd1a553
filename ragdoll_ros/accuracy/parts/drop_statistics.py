"""Statistics of many drops: one drop is chaotic, but the distribution of many converges.

Two populations: drops of random orientation and pose, and the default drop tilted by milliradians;
each with restitution and without.
Samples are compared with the reference's by the two-sample Kolmogorov-Smirnov test.
"""
import dataclasses
import functools
import math

import numpy as np

from ...model import rotation
from ...physics.accuracy import ACCURACIES
from ..cases import starts
from ..cases.comparison import FRICTION, RESTITUTIONS, compared, drop_scene
from ..cases.trial import Trial
from ..methods import by_name, installed, reference, run
from ..metrics import Metrics
from ..results.runner import Job, Row, RunOptions
from ..trajectory import Trajectory

NAME = 'drops'
REFINEMENT = 50
"""Step of `normal` over that of the reference."""

DURATION, CHUNK = 3.0, 10
"""s of each drop, and drops per job."""

OTHERS = ('bullet-4', 'bullet-10', 'mujoco-implicitfast-4', 'mujoco-implicitfast-10', 'dart-4',
          'dart-10')
QUICK_OTHERS = ('bullet-10',)

INELASTIC = ('mujoco-implicitfast-100', 'drake-10')
"""Also without restitution: MuJoCo at steps of 0.1 ms, whose law is then ours, and Drake."""

TILTED = ('dart-100',)
"""Also of the default drop: DART at steps of 0.1 ms, whose law is ours but for the pyramid."""

INSTANTS = (0.3, 0.5, 1.0)
"""s after release at which energies are compared; the first contact is at 0.286 s."""

QUANTITIES = (*(f'energy_{instant:g}s' for instant in INSTANTS), 'slide_m', 'settled_s', 'spread_m')
TILT = 4e-3
"""Largest tilt about x and y, rad."""


def random_drop(number: int, restitution: float) -> Trial:
    """The doll dropped from 0.4 m in a random orientation and pose."""
    trial = compared(starts.trial('drop .4 m', number), restitution)
    return dataclasses.replace(trial, duration=DURATION)


def tilted_drop(number: int, restitution: float) -> Trial:
    """The default drop with a small random tilt."""
    rng, scene = np.random.default_rng([20, number]), drop_scene(restitution)
    tilt = (*rng.uniform(-TILT, TILT, 2), 0.0)
    placement = dataclasses.replace(scene.dolls[0], orientation=tuple(
        rotation.from_rotation_vector(np.array(tilt))))
    return Trial(dataclasses.replace(scene, dolls=(placement,)), DURATION)


POPULATIONS = {f'{name}, e = {restitution:g}': functools.partial(make, restitution=restitution)
               for restitution in RESTITUTIONS
               for name, make in (('random', random_drop), ('default, tilted', tilted_drop))}
COUNTS = dict(zip(POPULATIONS, (300, 30, 100, 30), strict=True))
QUICK_COUNTS = dict.fromkeys([name for name in POPULATIONS if name.startswith('random')], 4)


def jobs(options: RunOptions) -> list[Job]:
    """Jobs of CHUNK drops by each method; first the reference, which takes longest."""
    counts = QUICK_COUNTS if options.quick else COUNTS
    common = [reference(REFINEMENT).name, *(f'ours-{accuracy}' for accuracy in ACCURACIES),
              *(QUICK_OTHERS if options.quick else installed(OTHERS))]
    made = []
    for population, count in counts.items():
        checks = [*(INELASTIC if population.endswith('e = 0') else ()),
                  *(TILTED if population.startswith('default') else ())]
        for name in (*common, *([] if options.quick else installed(checks))):
            for first in range(0, count, CHUNK):
                end = min(first + CHUNK, count)
                made.append(Job(NAME, f'{population} drops, {name}', functools.partial(
                    measure, population, name, first, end),
                    (end - first) * (2.0 if name in (common[0], *TILTED) else 0.15)))
    return made


def measure(population: str, name: str, first: int, end: int) -> list[Row]:
    """One row with the quantities of drops first ... end - 1."""
    method, found = by_name(name), []
    for number in range(first, end):
        trial = POPULATIONS[population](number)
        found.append(quantities(trial, run(method, trial).trajectory))
    return [{'population': population, 'method': name, 'label': method.label,
             'friction': FRICTION, 'drops': end - first,
             'values': {key: [row[key] for row in found] for key in QUANTITIES}}]


def quantities(trial: Trial, trajectory: Trajectory) -> dict[str, float]:
    """Relative energies, slide of the centre of mass, settling time, RMS distance of the bones from
    their mean at the end.
    """
    metrics = Metrics(trial.scene)
    masses = np.array([bone.mass for bone in trial.scene.bones])
    energy = metrics.energy(trajectory)
    centres = np.einsum('n,tnd->td', masses, trajectory.positions) / masses.sum()
    apart = trajectory.positions[-1] - trajectory.positions[-1].mean(axis=0)
    left = {f'energy_{instant:g}s': float(np.interp(instant, trajectory.times, energy) / energy[0])
            for instant in INSTANTS}
    return {**left, 'slide_m': float(np.hypot(*(centres[-1] - centres[0])[:2])),
            'settled_s': metrics.settling_time(trajectory),
            'spread_m': float(np.sqrt((apart ** 2).sum(axis=1).mean()))}


def merged(rows: list[Row]) -> list[Row]:
    """Aggregate rows by population and method, the reference first, and compare them with it."""
    found: dict[tuple, Row] = {}
    for row in rows:
        if 'failed' in row:
            found[(row['job'], len(found))] = row
            continue
        whole = found.setdefault((row['population'], row['method']), {
            **row, 'drops': 0, 'values': {key: [] for key in QUANTITIES}})
        whole['drops'] += row['drops']
        for key in QUANTITIES:
            whole['values'][key] += row['values'][key]
    references: dict[str, Row] = {}
    for row in found.values():
        if 'failed' not in row:
            row |= compare_with_reference(row, references.setdefault(row['population'], row))
    return list(found.values())


def compare_with_reference(row: Row, truth: Row) -> Row:
    """Mean, its standard error, and Kolmogorov-Smirnov p-value of each quantity.

    ``off`` is the difference of the means in its standard errors. Drops that have not settled
    count as settling at the end.
    """
    from scipy.stats import ks_2samp
    found: Row = {}
    for key in QUANTITIES:
        own, other = (np.minimum(np.nan_to_num(sample['values'][key], nan=1e9), 1e9)
                      for sample in (row, truth))
        if key == 'settled_s':
            own, other = np.minimum(own, DURATION), np.minimum(other, DURATION)
        errors = [float(sample.std(ddof=1)) / math.sqrt(len(sample)) if len(sample) > 1 else 0.0
                  for sample in (own, other)]
        apart, scale = float(own.mean() - other.mean()), math.hypot(*errors)
        found |= {f'{key}_mean': float(own.mean()), f'{key}_error': errors[0],
                  f'{key}_off': abs(apart) / scale if apart else 0.0,
                  f'{key}_p': float(ks_2samp(own, other).pvalue)}
    return found
