"""DollSums computes DollTotals from the bones' states, independently of any engine."""
from __future__ import annotations

import numpy as np

from ....model.scene import Scene
from ....model.state import State
from ...doll_totals import DollTotals
from ...rigid_body import cross


class DollSums:
    """Masses (n,) kg and principal inertias (n, 3) kg m^2 of all bones, for sums over d dolls."""

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
