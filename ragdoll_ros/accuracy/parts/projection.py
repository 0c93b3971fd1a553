"""What keeping energy and momentum costs in flight, and what it does to the error."""
from __future__ import annotations

import dataclasses
import functools

from ...settings import ACCURACIES
from ..measure import Measure, compare
from ..methods import median_run, ours
from ..runner import Job, Options, Row
from .precision import motions

NAME = 'projection'
MOTIONS = ('flight_gentle', 'flight_fast', 'tumbling_box')
SWITCHES: dict[str, dict[str, object]] = {
    '': {}, 'energy': {'energy': False}, 'momentum': {'momentum': False},
    'both': {'energy': False, 'momentum': False}}


def jobs(options: Options) -> list[Job]:
    """One timed job for each motion."""
    repeats = 1 if options.quick else 5
    return [Job(NAME, f'projection, {name}', functools.partial(measure, name, repeats),
                0.4 * repeats, timed=True) for name in MOTIONS]


def measure(name: str, repeats: int) -> list[Row]:
    """A flight at each setting, with all on and with the corrections off."""
    motion, rows = motions()[name], []
    truth = motion.truth(motion.trial.times())
    scales = Measure(motion.trial.scene)
    for accuracy, setting in ACCURACIES.items():
        for switched, changes in SWITCHES.items():
            method = ours(dataclasses.replace(setting, **changes), f'{accuracy} {switched}')
            result = median_run(method, motion.trial, repeats)
            rows.append({'motion': motion.title, 'accuracy': accuracy, 'switched': switched,
                         'cpu_s_per_s': result.rate, **compare(result.moved, truth),
                         'energy_excess': scales.excess(motion.trial, result.moved),
                         'momentum_drift': scales.momentum_drift(motion.trial, result.moved),
                         'angular_momentum_drift': scales.spin_drift(result.moved)})
    return rows
