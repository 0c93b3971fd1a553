"""What a method did: the state of every bone at every tick, and how it was measured."""
from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..model.state import State


@dataclass(frozen=True)
class Trajectory:
    """States of n bones at t instants, world frame, SI."""

    times: np.ndarray
    """(t,) s."""
    positions: np.ndarray
    """(t, n, 3) m, of the centres of mass."""
    orientations: np.ndarray
    """(t, n, 4) unit quaternions x, y, z, w, of the shapes' own axes."""
    linear_velocities: np.ndarray
    """(t, n, 3) m/s."""
    angular_velocities: np.ndarray
    """(t, n, 3) rad/s, world axes."""

    @classmethod
    def of(cls, times: Iterable[float], states: Iterable[State]) -> Trajectory:
        """Stack states, one for each time."""
        states = list(states)
        fields = ('positions', 'orientations', 'linear_velocities', 'angular_velocities')
        return cls(np.array(list(times), float),
                   *(np.array([getattr(state, field) for state in states], float)
                     for field in fields))

    def at(self, index: int) -> State:
        """State at one of the instants."""
        return State(self.positions[index], self.orientations[index], self.linear_velocities[index],
                     self.angular_velocities[index])

    def part(self, which: slice) -> Trajectory:
        """Give the instants ``which`` names."""
        return Trajectory(*(array[which] for array in vars(self).values()))

    @property
    def finite(self) -> bool:
        """Whether every number is one."""
        return all(np.isfinite(array).all() for array in vars(self).values())
