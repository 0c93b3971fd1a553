"""The price of keeping an account of PyBullet's energy and momentum, and what it does to errors."""
from __future__ import annotations

import dataclasses
import functools

from ...physics.settings import ACCURACIES
from ..measure import Measure, compare
from ..methods import median_run, ours
from ..runner import Job, Options, Row
from .precision import motions

NAME = 'projection'
SWITCHED: dict[str, dict[str, object]] = {'': {}, 'energy, momentum': {'energy': False}}
MOTIONS = ('flight_gentle', 'flight_fast', 'tumbling_box', 'incline_slip', 'rolling_ball')


def jobs(options: Options) -> list[Job]:
    """One timed job for each motion."""
    repeats = 1 if options.quick else 5
    return [Job(NAME, f'projection, {name}', functools.partial(measure, name, repeats),
                0.4 * repeats, timed=True) for name in MOTIONS]


def measure(name: str, repeats: int) -> list[Row]:
    """A motion at each setting, with all on and with its corrections off."""
    motion, rows = motions()[name], []
    truth = motion.truth(motion.trial.times())
    scales = Measure(motion.trial.scene)
    for accuracy, setting in ACCURACIES.items():
        for switched, changes in SWITCHED.items():
            method = ours(dataclasses.replace(setting, **changes), f'{accuracy} {switched}',
                          'bullet')
            result = median_run(method, motion.trial, repeats)
            row = {'motion': motion.title, 'accuracy': accuracy, 'switched': switched,
                   'cpu_s_per_s': result.rate, **compare(result.trajectory, truth),
                   'energy_excess': scales.energy_excess(motion.trial, result.trajectory)}
            if motion.in_air:
                row['momentum_drift'] = scales.momentum_drift(motion.trial, result.trajectory)
                row['angular_momentum_drift'] = scales.angular_momentum_drift(result.trajectory)
            rows.append(row)
    return rows
