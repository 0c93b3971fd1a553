"""The dolls of a scene in the air, compiled: where bones are, accelerations, and flights."""
from __future__ import annotations

import math

import numpy as np

from ..model.coordinates import GeneralizedState
from ..model.scene import Scene
from ..model.state import State
from .engine.protocol import Wrenches
from .kernels.loaded import kernels
from .settings import Accuracy
from .tree import table

FIRST_TURN = 0.2
"""rad that the fastest bone turns in the first step that is tried."""

SAFETY = 0.8
"""Share of the longest step that the tolerance allows, as the last error tells, that is taken."""

SHORTER, LONGER = 0.2, 2.0
"""Bounds of a step over the one before."""

MOST_TRIES = 40
"""Steps tried in 10 ms: more are for what the engine does better, or for what is no motion."""

USUAL = 0.01
"""s for which they are counted."""

HELPED = 0.5
"""Share of a step's error that a shorter one must come below; where it does not, what is left is
rounding."""


class CompiledDynamics:
    """The equations of motion of a scene's dolls where nothing touches and no joint has a limit."""

    keeps_momentum = cheap = True

    def __init__(self, scene: Scene) -> None:
        self._tree = table(scene)
        self._gravity = np.array(scene.gravity, float)

    def state(self, coordinates: GeneralizedState) -> State:
        rows = np.empty((len(self._tree), 13))
        kernels.forward_kinematics(self._tree, coordinates.q, coordinates.v, rows)
        return State.of(rows)

    def acceleration(self, coordinates: GeneralizedState, loads: Wrenches = ()) -> np.ndarray:
        out = np.empty_like(coordinates.v)
        kernels.accelerate(self._tree, self._gravity, _packed(loads), coordinates.q, coordinates.v,
                           out)
        return out

    def integrate_configuration(self, coordinates: GeneralizedState,
                                displacement: np.ndarray) -> GeneralizedState:
        q = coordinates.q.copy()
        kernels.integrate_configuration(self._tree, q, displacement)
        return GeneralizedState(q, coordinates.v)

    def longest(self, accuracy: Accuracy, fastest: float) -> float:
        """Any path will do: it chooses its steps itself."""
        return math.inf

    def path(self, start: GeneralizedState, duration: float, accuracy: Accuracy, fastest: float,
             loads: Wrenches = (), after: Path | None = None) -> Path:
        """Fly from ``start`` on without end, in steps of ``duration`` s at the most."""
        return Path(self, start, accuracy.flight_error, duration, fastest, loads)

    def fly(self, start: GeneralizedState, duration: float, steps: int,
            loads: Wrenches = ()) -> GeneralizedState:
        """The coordinates ``duration`` s later, in equal steps."""
        known, rows = None, _packed(loads)
        for _ in range(steps):
            known = self.step(start, duration / steps, rows, known)
            start = known.at(1.0)
        return start

    def close(self) -> None:
        """Nothing to give back: the memory goes with the object."""

    def step(self, start: GeneralizedState, duration: float, loads: np.ndarray,
             before: Step | None = None) -> Step:
        """Go one step, from where the step ``before`` ended, if any."""
        return Step(self._tree, self._gravity, start, duration, loads, before)


class Step:
    """One step of a flight, ``duration`` s long; ``error``, m or rad: of its end, by DOP853."""

    def __init__(self, tree: np.ndarray, gravity: np.ndarray, start: GeneralizedState,
                 duration: float,
                 loads: np.ndarray, before: Step | None = None) -> None:
        self.duration = duration
        self._tree, self._sizes = tree, (len(start.q), len(start.v))
        self._dense = np.empty((8, sum(self._sizes)))
        self._rates = np.empty((2, sum(self._sizes)))
        if before is not None:
            self._rates[0] = before._rates[1]
        self.error = kernels.step(tree, gravity, loads, start.q, start.v, duration,
                                  before is not None, self._dense, self._rates)

    def at(self, share: float) -> GeneralizedState:
        """The coordinates after a share of the step."""
        q, v = np.empty(self._sizes[0]), np.empty(self._sizes[1])
        kernels.interpolate(self._tree, self._dense, share, q, v)
        return GeneralizedState(q, v)


class Path:
    """A flight from ``start`` on, gone step by step as far as it is asked for.

    Steps are as long as their error stays below ``tolerance`` (m or rad), at most ``longest`` s;
    just that with an infinite tolerance.
    """

    duration = math.inf

    def __init__(self, dynamics: CompiledDynamics, start: GeneralizedState, tolerance: float,
                 longest: float, fastest: float, loads: Wrenches = ()) -> None:
        self._dynamics, self._loads = dynamics, _packed(loads)
        self._tolerance, self._longest = tolerance, longest
        first = longest if math.isinf(tolerance) else FIRST_TURN / max(fastest, 1e-9)
        self._try = min(longest, first)
        self._steps: list[tuple[float, Step]] = []
        """What was gone, each with its beginning, s, back to what was asked for last."""
        self._end, self._end_at, self._asked = start, 0.0, 0.0
        self._refused: Step | None = None
        """A step from the end that erred too much."""
        self.count = 0
        """Steps gone, the rejected ones too."""

    def at(self, time: float) -> GeneralizedState | None:
        """The coordinates ``time`` s after the start; None if that takes too many steps.

        One may look back, but not to before the time that was the latest when it was asked for
        a later one.
        """
        most = self.count + math.ceil(MOST_TRIES * max(1.0, (time - self._end_at) / USUAL))
        if time > self._asked:
            self._steps = [(begin, step) for begin, step in self._steps
                           if begin + step.duration >= self._asked]
            self._asked = time
        while time > self._end_at + 1e-12:
            if self.count >= most:
                return None
            self._go_on()
        if not self._steps:
            return self._end
        begin, step = next(known for known in reversed(self._steps)
                           if time >= known[0] - 1e-12 or known is self._steps[0])
        return step.at(min(1.0, max(0.0, (time - begin) / step.duration)))

    def _go_on(self) -> None:
        before = self._steps[-1][1] if self._steps else None
        step = self._dynamics.step(self._end, self._try, self._loads, before)
        self.count += 1
        if self._refused is not None and HELPED * self._refused.error < step.error < math.inf:
            step = self._refused
            self._tolerance = max(self._tolerance, 2 * step.error)
        ratio = step.error / self._tolerance
        self._refused = step if ratio > 1 else None
        if ratio <= 1:
            self._steps.append((self._end_at, step))
            self._end, self._end_at = step.at(1.0), self._end_at + step.duration
        factor = SAFETY * ratio ** -0.125 if ratio > 0 else LONGER
        self._try = min(self._longest, step.duration * min(LONGER, max(SHORTER, factor)))


def _packed(loads: Wrenches) -> np.ndarray:
    """Loads as a table (m, 11) for compiled code."""
    rows = np.empty((len(loads), 11))
    for row, load in zip(rows, loads, strict=True):
        row[0], row[1:4], row[4:7], row[7:10], row[10] = (
            load.bone, load.force, load.torque, load.point, load.local)
    return rows
