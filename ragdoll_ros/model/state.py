"""What a simulation tells about its bones at one instant."""
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from . import rotation


@dataclass(frozen=True)
class State:
    """Poses and velocities of n bones, world frame, float64, in the scene's bone order.

    A bone's pose is that of its centre of mass and of its shape's own axes, which are its
    principal axes of inertia.
    """

    positions: np.ndarray
    """(n, 3) m."""
    orientations: np.ndarray
    """(n, 4) unit quaternions x, y, z, w."""
    linear_velocities: np.ndarray
    """(n, 3) m/s, of the centre of mass."""
    angular_velocities: np.ndarray
    """(n, 3) rad/s, world axes."""

    @classmethod
    def of(cls, rows: np.ndarray) -> State:
        """From rows (n, 13) of position, orientation, linear and angular velocity."""
        state = cls(rows[:, 0:3], rows[:, 3:7], rows[:, 7:10], rows[:, 10:13])
        state.__dict__['rows'] = rows
        return state

    @cached_property
    def rows(self) -> np.ndarray:
        """(n, 13): position, orientation, linear and angular velocity side by side."""
        return np.concatenate([self.positions, self.orientations, self.linear_velocities,
                               self.angular_velocities],
                              axis=1)

    @cached_property
    def rotation_matrices(self) -> np.ndarray:
        """(n, 3, 3): the rotation matrices of the orientations."""
        return rotation.matrix(self.orientations)
