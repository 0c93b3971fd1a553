"""States of all bones over time, as computed by a method or a reference."""
from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..model import rotation
from ..model.state import State


@dataclass(frozen=True)
class Trajectory:
    """States of n bones at t instants, world frame, SI units."""

    times: np.ndarray
    """(t,) s."""
    positions: np.ndarray
    """(t, n, 3) m, of the centres of mass."""
    orientations: np.ndarray
    """(t, n, 4) unit quaternions x, y, z, w, of the bones' axes."""
    linear_velocities: np.ndarray
    """(t, n, 3) m/s."""
    angular_velocities: np.ndarray
    """(t, n, 3) rad/s, world axes."""

    @classmethod
    def of(cls, times: Iterable[float], states: Iterable[State]) -> Trajectory:
        """Stack states, one for each of the times in s."""
        states = list(states)
        fields = ('positions', 'orientations', 'linear_velocities', 'angular_velocities')
        return cls(np.array(list(times), float),
                   *(np.array([getattr(state, field) for state in states], float)
                     for field in fields))

    @classmethod
    def of_poses(cls, times: np.ndarray, positions: np.ndarray,
                 orientations: np.ndarray | None = None) -> Trajectory:
        """Poses (t, n, 3) m and (t, n, 4), identity if None; velocities are NaN."""
        if orientations is None:
            orientations = np.tile(rotation.IDENTITY, (*positions.shape[:2], 1))
        unknown = np.full(positions.shape, np.nan)
        return cls(np.asarray(times, float), positions, orientations, unknown, unknown)

    def at(self, index: int) -> State:
        """State at an index."""
        return State(self.positions[index], self.orientations[index], self.linear_velocities[index],
                     self.angular_velocities[index])

    def part(self, which: slice) -> Trajectory:
        """The instants of a slice."""
        return Trajectory(*(array[which] for array in vars(self).values()))

    @property
    def finite(self) -> bool:
        """Whether all numbers are finite."""
        return all(np.isfinite(array).all() for array in vars(self).values())
