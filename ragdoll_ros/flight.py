"""Flight: motion where nothing touches and no joint is at its limit, by Runge-Kutta.

The engine is asked for accelerations alone. Orders 2 (midpoint rule), 3 (Bogacki and Shampine,
Appl. Math. Lett. 2, 1989) and 4 (Kutta 1901); the engine's own step is of order 1.
Quaternions are integrated as four numbers and brought back to length one after each step,
which keeps the order (Hairer, Lubich, Wanner: Geometric Numerical Integration, IV.4).
"""
from __future__ import annotations

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


def fly(engine: Engine, start: Coordinates, duration: float, order: int, steps: int = 1,
        loads: Sequence[Load] = ()) -> Coordinates:
    """Give the coordinates ``duration`` s later, in equal steps of a method of this order.

    ``engine`` must hold the scene without contacts and limits; where it ends up is undefined.
    """
    for _ in range(steps):
        start = _step(engine, start, duration / steps, TABLEAUS[order], loads)
    return start


def _step(engine: Engine, start: Coordinates, h: float, method: Tableau,
          loads: Sequence[Load]) -> Coordinates:
    layout = engine.layout
    q, v = start.q, start.v
    slope_q = slope_v = None
    sum_q, sum_v = np.zeros_like(q), np.zeros_like(v)
    for node, weight in zip(method.nodes, method.weights, strict=True):
        stage = start
        if node:
            stage = Coordinates(q + node * h * slope_q, v + node * h * slope_v)
        slope_q = layout.derivative(stage.q, stage.v)
        slope_v = engine.acceleration(stage, loads)
        if weight:
            sum_q += weight * slope_q
            sum_v += weight * slope_v
    return Coordinates(layout.normalized(q + h * sum_q), v + h * sum_v)
