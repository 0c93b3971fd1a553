"""Flight: motion where nothing touches and no joint is at its limit, by Runge-Kutta.

The engine is asked for accelerations alone. Orders 2 (midpoint rule), 3 (Bogacki and Shampine,
Appl. Math. Lett. 2, 1989) and 4 (Kutta 1901); the engine's own step is of order 1.
Quaternions are integrated as four numbers and brought back to length one after each step,
which keeps the order (Hairer, Lubich, Wanner: Geometric Numerical Integration, IV.4).
"""
from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .coordinates import Coordinates
from .engine.protocol import Engine, Load


@dataclass(frozen=True)
class Tableau:
    """An explicit Runge-Kutta method whose every stage builds on the one before alone."""

    order: int
    nodes: tuple[float, ...]
    weights: tuple[float, ...]


TABLEAUS = {tableau.order: tableau for tableau in (
    Tableau(2, nodes=(0, 1 / 2), weights=(0, 1)),
    Tableau(3, nodes=(0, 1 / 2, 3 / 4), weights=(2 / 9, 1 / 3, 4 / 9)),
    Tableau(4, nodes=(0, 1 / 2, 1 / 2, 1), weights=(1 / 6, 1 / 3, 1 / 3, 1 / 6)))}


class Path:
    """One step of a flight, ``duration`` s long, that tells where it leads at any time within.

    In between it is the cubic that has the positions, velocities and accelerations of both ends
    (Hairer, Norsett, Wanner: Solving Ordinary Differential Equations I, II.6), of order 3. What
    the end has is what the next step begins with: ``after`` hands it on.
    """

    def __init__(self, engine: Engine, start: Coordinates, duration: float, order: int,
                 loads: Sequence[Load] = (), after: Path | None = None) -> None:
        self._engine, self._loads = engine, loads
        self._start, self.duration = start, duration
        rates = after._end_rates[1] if after else engine.acceleration(start, loads)
        self._rates = (engine.layout.derivative(start.q, start.v), rates)
        self.end = _step(engine, start, self._rates, duration, TABLEAUS[order], loads)

    def at(self, time: float) -> Coordinates:
        """Give the coordinates ``time`` s after the start."""
        s = time / self.duration
        if s > 1 - 1e-12:
            return self.end
        h = self.duration * s * (1 - s)
        way, late = s * s * (3 - 2 * s), -h * s
        first = h * (1 - s)
        q, v = (a + way * (b - a) + first * rate_a + late * rate_b for a, b, rate_a, rate_b in zip(
            (self._start.q, self._start.v), (self.end.q, self.end.v), self._rates,
            self._end_rates, strict=True))
        return Coordinates(self._engine.layout.normalized(q), v)

    @functools.cached_property
    def _end_rates(self) -> tuple[np.ndarray, np.ndarray]:
        """Rates of change of q and v at the end."""
        return (self._engine.layout.derivative(self.end.q, self.end.v),
                self._engine.acceleration(self.end, self._loads))


def fly(engine: Engine, start: Coordinates, duration: float, order: int, steps: int = 1,
        loads: Sequence[Load] = ()) -> Coordinates:
    """Give the coordinates ``duration`` s later, in equal steps of a method of this order.

    ``engine`` must hold the scene without contacts and limits; where it ends up is undefined.
    """
    for _ in range(steps):
        start = Path(engine, start, duration / steps, order, loads).end
    return start


def _step(engine: Engine, start: Coordinates, rates: tuple[np.ndarray, np.ndarray], h: float,
          method: Tableau, loads: Sequence[Load]) -> Coordinates:
    layout = engine.layout
    q, v = start.q, start.v
    rate_q, rate_v = rates
    sum_q, sum_v = method.weights[0] * rate_q, method.weights[0] * rate_v
    for node, weight in zip(method.nodes[1:], method.weights[1:], strict=True):
        stage = Coordinates(q + node * h * rate_q, v + node * h * rate_v)
        rate_q, rate_v = layout.derivative(stage.q, stage.v), engine.acceleration(stage, loads)
        sum_q += weight * rate_q
        sum_v += weight * rate_v
    return Coordinates(layout.normalized(q + h * sum_q), v + h * sum_v)
