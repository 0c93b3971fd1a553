"""Order of convergence of each method: slope of the error over the tick."""
import dataclasses
import functools
import itertools
import math

import numpy as np

from ...physics import kernels
from ...physics.accuracy import ACCURACIES
from ..methods import Method, bullet, mujoco, ours, run
from ..metrics import compare
from ..results.runner import Job, Row, RunOptions
from .work_precision import motions

NAME = 'orders'
TICKS = (0.02, 0.01, 0.005, 0.0025, 0.00125)
FEW_TICKS = {'pendulum_large': (10, 16, 20), 'flight_gentle': (2, 4, 5, 7),
             'flight_long': (16, 20, 25, 32, 40, 50, 64)}
"""Ticks per motion for order 8: errors above rounding, whole numbers of ns per tick."""

MOTIONS = ('pendulum_large', 'flight_gentle', 'flight_long')
FLOOR = 1e-11
"""Smaller errors are those of the reference or rounding (a pendulum's root moves by 2e-11 m)."""

LOW_FLOOR = 2e-14
"""The same for order 8 at few ticks."""

CEILING = 0.3
"""Larger errors are not in the asymptotic range."""


def methods() -> list[Method]:
    """One method of each family, with one step per tick where this can be set."""
    mine = [ours(dataclasses.replace(setting, flight_error=math.inf), f'ours-{name}')
            for name, setting in ACCURACIES.items()]
    # Compiled, the accuracies differ in the step size alone.
    return [*(mine[-1:] if kernels.ready() else mine), bullet(1),
            *(mujoco(name, 1) for name in ('euler', 'implicitfast', 'rk4'))]


def jobs(options: RunOptions) -> list[Job]:
    """One job for each motion."""
    names = MOTIONS[:2] if options.quick else MOTIONS
    return [Job(NAME, f'orders, {name}', functools.partial(measure_all, name), weight=3.0)
            for name in names]


def measure_all(motion_name: str) -> list[Row]:
    """Errors at all ticks and the slope of their logarithms, for all methods."""
    motion, rows = motions()[motion_name], []
    few = tuple(motion.trial.duration / count for count in FEW_TICKS[motion_name])
    truths = {tick: motion.truth(motion.trial.with_tick(tick).times()) for tick in TICKS + few}
    # Without self-collision a flight is one step per tick.
    scene = dataclasses.replace(motion.trial.scene, self_collision=False)
    trial = dataclasses.replace(motion.trial, scene=scene)
    for method in methods():
        errors, high = [], method.order == kernels.ORDER
        ticks, floor = (few, LOW_FLOOR) if high else (TICKS, FLOOR)
        for tick in ticks:
            result = run(method, trial.with_tick(tick))
            errors.append(compare(result.trajectory, truths[tick])[motion.error_key])
        rows.append({'motion': motion_name, 'title': motion.title, 'method': method.name,
                     'label': method.label.removesuffix(', N = 1'), 'theory': method.order,
                     'ticks_s': list(ticks), 'errors': errors, **slope(ticks, errors, floor)})
    return rows


def slope(ticks: tuple[float, ...], errors: list[float], floor: float) -> dict[str, object]:
    """Order by least squares on the logarithms of the errors in the asymptotic range.

    That range holds the errors below CEILING, from the coarsest tick down to the first error at
    ``floor``; it needs three points. Also the slope between its two finest ticks.
    """
    usable = [(tick, error) for tick, error in zip(ticks, errors, strict=True)
              if math.isfinite(error) and error < CEILING]
    usable = list(itertools.takewhile(lambda pair: pair[1] > floor, usable))
    if len(usable) < 3:
        return {'order': None, 'points': len(usable)}
    x, y = np.log(np.array(usable)).T
    return {'order': float(np.polyfit(x, y, 1)[0]), 'points': len(usable),
            'order_finest': float((y[-1] - y[-2]) / (x[-1] - x[-2]))}
