"""What a method did: the state of every bone at every tick, and how it was measured."""
from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..model import rotation
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
        """States stacked, one for each of the times in s."""
        states = list(states)
        fields = ('positions', 'orientations', 'linear_velocities', 'angular_velocities')
        return cls(np.array(list(times), float),
                   *(np.array([getattr(state, field) for state in states], float)
                     for field in fields))

    @classmethod
    def of_poses(cls, times: np.ndarray, positions: np.ndarray,
                 orientations: np.ndarray | None = None) -> Trajectory:
        """Poses (t, n, 3) m and (t, n, 4), unrotated if None; velocities are left NaN."""
        if orientations is None:
            orientations = np.tile(rotation.IDENTITY, (*positions.shape[:2], 1))
        unknown = np.full(positions.shape, np.nan)
        return cls(np.asarray(times, float), positions, orientations, unknown, unknown)

    def at(self, index: int) -> State:
        """State at one of the instants."""
        return State(self.positions[index], self.orientations[index], self.linear_velocities[index],
                     self.angular_velocities[index])

    def part(self, which: slice) -> Trajectory:
        """The instants that ``which`` picks."""
        return Trajectory(*(array[which] for array in vars(self).values()))

    @property
    def finite(self) -> bool:
        """Whether every number is one."""
        return all(np.isfinite(array).all() for array in vars(self).values())
