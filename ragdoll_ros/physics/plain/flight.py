"""Flight: motion where nothing touches and no joint is at its limit, by Runge-Kutta.

Where numba is installed, physics/dynamics.py flies, by a method of order 8. Here is what does
without: an engine is asked for accelerations alone. Orders 2 (midpoint rule), 3 (Bogacki and
Shampine, Appl. Math. Lett. 2, 1989) and 4 (Kutta 1901); the engine's own step is of order 1.
Quaternions are integrated as four numbers and brought back to length one after each step,
which keeps the order (Hairer, Lubich, Wanner: Geometric Numerical Integration, IV.4). Angular
velocities are integrated along the root's own axes, where a steady spin hardly changes them: a
tumbling plate's error is 300 times smaller so than along the world's.
"""
from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from ...model.coordinates import DofLayout, GeneralizedState
from ...model.scene import Scene
from ...model.state import State
from ..engine.protocol import Engine, Wrenches
from ..flight import STIFFEST
from ..motion import damping_rate
from ..settings import Accuracy


class EngineDynamics:
    """Accelerations from an engine that holds the scene without contacts and limits."""

    keeps_momentum = cheap = False

    def __init__(self, scene: Scene, make_engine: type[Engine], layout: DofLayout) -> None:
        self._engine = make_engine(scene, free=True)
        self._layout = layout
        self._damping_rate = damping_rate(scene)

    def state(self, coordinates: GeneralizedState) -> State:
        self._engine.place(coordinates)
        return self._engine.read()

    def acceleration(self, coordinates: GeneralizedState, loads: Wrenches = ()) -> np.ndarray:
        return self._engine.acceleration(coordinates, loads)

    def integrate_configuration(self, coordinates: GeneralizedState,
                                displacement: np.ndarray) -> GeneralizedState:
        return self._layout.integrate_configuration(coordinates, displacement)

    def longest(self, accuracy: Accuracy, fastest: float) -> float:
        """Longest path, s, that speeds and damping allow."""
        return min(accuracy.flight_turn / max(fastest, 1e-9),
                   STIFFEST / max(self._damping_rate, 1e-9))

    def path(self, start: GeneralizedState, duration: float, accuracy: Accuracy, fastest: float,
             loads: Wrenches = (), after: EnginePath | None = None) -> EnginePath:
        """Fly from ``start`` on for ``duration`` s, in one step."""
        return EnginePath(self._engine, start, duration, accuracy.order, loads, after)

    def fly(self, start: GeneralizedState, duration: float, steps: int,
            loads: Wrenches = ()) -> GeneralizedState:
        """The coordinates ``duration`` s later, in equal steps of order 4."""
        return fly(self._engine, start, duration, 4, steps, loads)

    def close(self) -> None:
        self._engine.close()


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


class EnginePath:
    """One step of a flight, ``duration`` s long, that tells where it leads at any time within.

    In between it is the cubic that has the positions, velocities and accelerations of both ends
    (Hairer, Norsett, Wanner: Solving Ordinary Differential Equations I, II.6), of order 3. What
    the end has is what the next step begins with: ``after`` hands it on.
    """

    count = 1

    def __init__(self, engine: Engine, start: GeneralizedState, duration: float, order: int,
                 loads: Wrenches = (), after: EnginePath | None = None) -> None:
        self._engine, self._loads, self.duration = engine, loads, duration
        layout = engine.layout
        turns = layout.root_turns(start.q).transpose(0, 2, 1)
        self._start = (start.q, layout.with_spins_turned(start.v, turns))
        self._rates = ((layout.derivative(*self._start), after._end_rates[1]) if after
                       else _rates(engine, *self._start, loads))
        self._end = _step(engine, self._start, self._rates, duration, TABLEAUS[order], loads)
        self.end = self._outward(*self._end)

    def at(self, time: float) -> GeneralizedState:
        """The coordinates ``time`` s after the start."""
        s = time / self.duration
        if s > 1 - 1e-12:
            return self.end
        h = self.duration * s * (1 - s)
        way, late = s * s * (3 - 2 * s), -h * s
        first = h * (1 - s)
        q, v = (a + way * (b - a) + first * rate_a + late * rate_b for a, b, rate_a, rate_b in zip(
            self._start, self._end, self._rates, self._end_rates, strict=True))
        return self._outward(self._engine.layout.normalized(q), v)

    @functools.cached_property
    def _end_rates(self) -> tuple[np.ndarray, np.ndarray]:
        """Rates of change of q and v at the end."""
        return _rates(self._engine, *self._end, self._loads)

    def _outward(self, q: np.ndarray, v: np.ndarray) -> GeneralizedState:
        layout = self._engine.layout
        return GeneralizedState(q, layout.with_spins_turned(v, layout.root_turns(q)))


def fly(engine: Engine, start: GeneralizedState, duration: float, order: int, steps: int = 1,
        loads: Wrenches = ()) -> GeneralizedState:
    """The coordinates ``duration`` s later, in equal steps of a method of this order.

    ``engine`` must hold the scene without contacts and limits; where it ends up is undefined.
    """
    for _ in range(steps):
        start = EnginePath(engine, start, duration / steps, order, loads).end
    return start


def _step(engine: Engine, start: tuple[np.ndarray, np.ndarray],
          rates: tuple[np.ndarray, np.ndarray], h: float, method: Tableau,
          loads: Wrenches) -> tuple[np.ndarray, np.ndarray]:
    q, v = start
    rate_q, rate_v = rates
    sum_q, sum_v = method.weights[0] * rate_q, method.weights[0] * rate_v
    for node, weight in zip(method.nodes[1:], method.weights[1:], strict=True):
        rate_q, rate_v = _rates(engine, q + node * h * rate_q, v + node * h * rate_v, loads)
        sum_q += weight * rate_q
        sum_v += weight * rate_v
    return engine.layout.normalized(q + h * sum_q), v + h * sum_v


def _rates(engine: Engine, q: np.ndarray, v: np.ndarray,
           loads: Wrenches) -> tuple[np.ndarray, np.ndarray]:
    """Rates of change of q and v, roots' spins along their own axes: w' = R^T w'_world.

    A stage's quaternions are brought to length one: its rates are those of a turn, not of a turn
    and a stretch, which makes the error of fast spins 30 times smaller.
    """
    layout = engine.layout
    q = layout.normalized(q)
    turns = layout.root_turns(q)
    rates = engine.acceleration(GeneralizedState(q, layout.with_spins_turned(v, turns)), loads)
    return layout.derivative(q, v), layout.with_spins_turned(rates, turns.transpose(0, 2, 1))
