"""Flight: motion where nothing touches and no joint is at its limit; what any way to fly gives."""
from __future__ import annotations

from typing import Protocol

import numpy as np

from ..model.coordinates import GeneralizedState
from ..model.state import State
from .engine.protocol import Wrenches
from .settings import Accuracy

STIFFEST = 1.5
"""Step times the fastest rate at which damping ends a motion: from 2 on, explicit steps make
energy of it."""


class Path(Protocol):
    """A flight under way, ``duration`` s long, in ``count`` steps so far."""

    duration: float
    count: int

    def at(self, time: float) -> GeneralizedState | None:
        """The coordinates ``time`` s after the start; None if that takes too many steps."""


class Dynamics(Protocol):
    """The equations of motion of a scene's dolls where nothing touches and no joint has a limit."""

    keeps_momentum: bool
    """Whether flights keep it to rounding."""
    cheap: bool
    """Whether ``state`` costs less than to ask an engine."""

    def state(self, coordinates: GeneralizedState) -> State:
        """Poses and velocities of all bones."""

    def acceleration(self, coordinates: GeneralizedState, loads: Wrenches = ()) -> np.ndarray:
        """Rates of change of ``coordinates.v``."""

    def integrate_configuration(self, coordinates: GeneralizedState,
                                displacement: np.ndarray) -> GeneralizedState:
        """The coordinates after a small displacement (nv,), m and rad along the directions of v."""

    def longest(self, accuracy: Accuracy, fastest: float) -> float:
        """Longest path, s, where the fastest bone turns with so many rad/s; infinity: any."""

    def path(self, start: GeneralizedState, duration: float, accuracy: Accuracy, fastest: float,
             loads: Wrenches = (), after: Path | None = None) -> Path:
        """Fly from ``start`` on for ``duration`` s or more, on ``after`` what ended there."""

    def fly(self, start: GeneralizedState, duration: float, steps: int,
            loads: Wrenches = ()) -> GeneralizedState:
        """The coordinates ``duration`` s later, in equal steps of the highest order."""

    def close(self) -> None:
        """Release everything."""
