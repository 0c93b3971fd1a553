"""The simulation's local error estimate against the true local error of each tick in flight.

The truth of a tick starts from the simulation's state before it: the equations of motion integrated
at 1e-12 over that tick. Ticks count if the simulation reports its estimate as trusted.
"""
from __future__ import annotations

import functools

import numpy as np

from ..methods import start_simulation
from ..references.articulated import Articulated
from ..results.runner import Job, Row, RunOptions
from .work_precision import motions

NAME = 'estimate'
MOTIONS = ('flight_gentle', 'flight_fast', 'flight_long')
FACTOR = 3.0
NOISE = 3e-14
"""m: rounding of positions and of the truth. Ticks whose error and estimate are both within a
FACTOR of it do not count."""


def jobs(options: RunOptions) -> list[Job]:
    """One job for each accuracy."""
    names = MOTIONS[:2] if options.quick else MOTIONS
    return [Job(NAME, f'live estimate, {accuracy}', functools.partial(measure, accuracy, names),
                2.0 * len(names)) for accuracy in ('draft', 'normal', 'exact')]


def measure(accuracy: str, names: tuple[str, ...]) -> list[Row]:
    """True and estimated local errors of all ticks of some flights."""
    true, estimated, distrusted = [], [], 0
    for name in names:
        trial = motions()[name].trial
        tree = Articulated(trial.scene.dolls[0].doll, trial.scene.gravity)
        simulation, tick = start_simulation(trial, accuracy), trial.scene.step
        for _ in range(round(trial.duration / tick)):
            before = simulation.coordinates
            truth = tree.trajectory(before.q, before.v, (0.0, tick)).positions[-1]
            state = simulation.advance()
            found = simulation.measures()
            if not found['error_trusted']:
                distrusted += 1
                continue
            true.append(float(np.linalg.norm(state.positions - truth, axis=-1).max()))
            estimated.append(float(found['error_estimate_m']))
        simulation.close()
    pairs = [(t, e) for t, e in zip(true, estimated, strict=True) if max(t, e) > FACTOR * NOISE]
    within = [max(t, e) <= FACTOR * min(t, e) for t, e in pairs]
    return [{'label': accuracy, 'ticks': len(pairs), 'distrusted': distrusted,
             'rounding': len(true) - len(pairs),
             'within_3': float(np.mean(within)) if within else None,
             'true': [t for t, _ in pairs], 'estimated': [e for _, e in pairs]}]
