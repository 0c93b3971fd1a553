"""Poses and velocities of all bones at one instant."""
from __future__ import annotations

from functools import cached_property

import numpy as np

from . import rotation
from .pose import Pose


class State:
    """Poses and velocities of n bones, world frame, float64, in the order of Scene.bone_names.

    A bone's frame is its centre of mass and its principal axes of inertia. Do not write to the
    arrays: derived quantities are cached.

    Args:
        positions: (n, 3) m, of the centres of mass.
        orientations: (n, 4) unit quaternions x, y, z, w.
        linear_velocities: (n, 3) m/s, of the centres of mass.
        angular_velocities: (n, 3) rad/s.

    Example:
        >>> with Simulation(load_scene('drop')) as simulation:
        ...     state = simulation.advance()
        >>> state.positions.shape, state.orientations.shape
        ((10, 3), (10, 4))
    """

    def __init__(self, positions: np.ndarray, orientations: np.ndarray,
                 linear_velocities: np.ndarray, angular_velocities: np.ndarray) -> None:
        self.rows = np.concatenate(
            [positions, orientations, linear_velocities, angular_velocities], axis=1, dtype=float)
        """(n, 13): position, orientation, linear and angular velocity side by side."""

    @classmethod
    def of(cls, rows: np.ndarray) -> State:
        """From rows (n, 13), without a copy; see ``rows``."""
        state = cls.__new__(cls)
        state.rows = rows
        return state

    @property
    def positions(self) -> np.ndarray:
        """(n, 3) m, of the centres of mass, world frame."""
        return self.rows[:, 0:3]

    @property
    def orientations(self) -> np.ndarray:
        """(n, 4) unit quaternions x, y, z, w, bone's axes to world."""
        return self.rows[:, 3:7]

    @property
    def linear_velocities(self) -> np.ndarray:
        """(n, 3) m/s, of the centres of mass, world frame."""
        return self.rows[:, 7:10]

    @property
    def angular_velocities(self) -> np.ndarray:
        """(n, 3) rad/s, world axes."""
        return self.rows[:, 10:13]

    @cached_property
    def rotation_matrices(self) -> np.ndarray:
        """(n, 3, 3), v_world = R v_bone."""
        return rotation.matrix(self.orientations)

    def poses(self, bones: np.ndarray | int | slice) -> Pose:
        """World poses of bones by index: an array of any shape, one, or a slice."""
        return Pose(self.positions[bones], self.orientations[bones])

    def __repr__(self) -> str:
        low, high = self.positions.min(axis=0), self.positions.max(axis=0)
        speed = np.linalg.norm(self.linear_velocities, axis=1).max()
        return (f'State of {len(self.rows)} bones, centres {_metres(low)} to {_metres(high)} m,'
                f' fastest {speed:.3g} m/s')


def _metres(point: np.ndarray) -> str:
    return '(' + ', '.join(f'{value:.3f}' for value in point) + ')'
