"""Energy, momentum and inertia of each doll: DollTotals holds them, DollSums computes them."""
from __future__ import annotations

import numpy as np

from ...model.scene import Scene
from ...model.state import State
from ..rigid_body import cross


class DollTotals:
    """Energy, centre of mass, momenta and inertia of each of d dolls, world frame."""

    def __init__(self, energy: np.ndarray, kinetic: np.ndarray, centre: np.ndarray,
                 momentum: np.ndarray, angular_momentum: np.ndarray, inertia: np.ndarray) -> None:
        self.rows = np.concatenate([energy[:, None], kinetic[:, None], centre, momentum,
                                    angular_momentum, inertia.reshape(-1, 9)], axis=1)
        """(d, 20): all quantities side by side."""

    @classmethod
    def of(cls, rows: np.ndarray) -> DollTotals:
        """Wrap rows (d, 20) without a copy."""
        totals = cls.__new__(cls)
        totals.rows = rows
        return totals

    @property
    def energy(self) -> np.ndarray:
        """Kinetic plus potential energy, (d,) J; potential energy is zero at the world's origin."""
        return self.rows[:, 0]

    @property
    def kinetic(self) -> np.ndarray:
        """Kinetic energy, (d,) J."""
        return self.rows[:, 1]

    @property
    def centre(self) -> np.ndarray:
        """Centre of mass, (d, 3) m."""
        return self.rows[:, 2:5]

    @property
    def momentum(self) -> np.ndarray:
        """Linear momentum, (d, 3) N s."""
        return self.rows[:, 5:8]

    @property
    def angular_momentum(self) -> np.ndarray:
        """Angular momentum about the doll's centre of mass, (d, 3) N m s."""
        return self.rows[:, 8:11]

    @property
    def inertia(self) -> np.ndarray:
        """Locked inertia about the centre of mass, joints fixed in the pose, (d, 3, 3) kg m^2."""
        return self.rows[:, 11:20].reshape(-1, 3, 3)


class DollSums:
    """Sums over the bones of each doll, from states of any engine."""

    def __init__(self, scene: Scene) -> None:
        self.masses = np.array([bone.mass for bone in scene.bones])
        self.inertias = np.array([bone.inertia for bone in scene.bones], float)
        self.gravity = np.array(scene.gravity, float)
        self.doll_of = scene.doll_of_bone
        self._starts = [own.start for own in scene.bone_slices]
        self.doll_masses = self._sum(self.masses)

    def totals(self, state: State) -> DollTotals:
        """Sum over each doll's bones, inertia by the parallel axis theorem. World frame, SI."""
        turns, velocities = state.rotation_matrices, state.linear_velocities
        inertias = np.matmul(turns * self.inertias[:, None, :], turns.transpose(0, 2, 1))
        spins = np.matmul(inertias, state.angular_velocities[:, :, None])[:, :, 0]
        momenta = self.masses[:, None] * velocities
        centre = self._sum(self.masses[:, None] * state.positions) / self.doll_masses[:, None]
        arms = state.positions - centre[self.doll_of]
        squares = (arms ** 2).sum(axis=1)[:, None, None] * np.eye(3)
        steiner = squares - arms[:, :, None] * arms[:, None, :]
        kinetic = self._sum((momenta * velocities + spins * state.angular_velocities).sum(axis=1))
        return DollTotals(
            kinetic / 2 - self.doll_masses * (centre @ self.gravity), kinetic / 2, centre,
            self._sum(momenta), self._sum(cross(arms, momenta) + spins),
            self._sum(inertias + self.masses[:, None, None] * steiner))

    def _sum(self, values: np.ndarray) -> np.ndarray:
        """Sum values (n, ...) over each doll's bones; (d, ...)."""
        return np.add.reduceat(values, self._starts)
