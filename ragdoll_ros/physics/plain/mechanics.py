"""Energy, momentum and angular momentum of the dolls of a scene, from their bones' states.

Plain sums over rigid bodies, independent of any engine. World frame, SI.
"""
from __future__ import annotations

import numpy as np

from ...model import rotation
from ...model.scene import Scene
from ...model.state import State
from ..motion import Motion, Shift


class Mechanics:
    """Masses and inertias of all n bones of a scene, and the sums over each of its d dolls."""

    def __init__(self, scene: Scene) -> None:
        bones = scene.bones
        self.masses = np.array([bone.mass for bone in bones])
        self.inertias = np.array([bone.inertia for bone in bones])
        self.gravity = np.array(scene.gravity)
        self.doll_of = scene.doll_of_bone
        self._members = (self.doll_of == np.arange(len(scene.dolls))[:, None]).astype(float)
        self._weights = self._members * self.masses
        self.doll_masses = self._weights.sum(axis=1)
        self._of_points = _sums_of_points()

    def energy(self, state: State) -> np.ndarray:
        """Kinetic energy plus that of height of each doll, (d,) J."""
        return self.motion(state).energy

    def motion(self, state: State) -> Motion:
        """All sums at once: of each bone as a point at its centre of mass, plus its own turning."""
        count, turns = len(self.masses), state.rotation_matrices
        inertias = np.matmul(turns * self.inertias[:, None, :], turns.transpose(0, 2, 1))
        spins = np.matmul(inertias, state.angular_velocities[:, :, None])[:, :, 0]
        energies = (spins * state.angular_velocities).sum(axis=1, keepdims=True) / 2
        own = np.concatenate([energies, spins, inertias.reshape(count, 9)], axis=1)
        centre = self._weights @ state.positions / self.doll_masses[:, None]
        point = np.concatenate([state.positions - centre[self.doll_of], state.linear_velocities],
                               axis=1)
        squares = (point[:, :, None] * point[:, None, :]).reshape(count, 36)
        sums = self._members @ own + self._weights @ squares @ self._of_points
        kinetic = sums[:, 0]
        return Motion(kinetic - self.doll_masses * (centre @ self.gravity), kinetic, centre,
                      self._weights @ state.linear_velocities, sums[:, 1:4],
                      sums[:, 4:].reshape(-1, 3, 3))

    def shifted(self, state: State, motion: Motion, shift: Shift) -> State:
        """The state after each doll is moved on and set in motion as one rigid body."""
        orientations, angular = state.orientations, state.angular_velocities
        if shift.rotation is not None:
            turns = shift.rotation[self.doll_of]
            orientations = rotation.multiply(turns, orientations)
            angular = rotation.rotate(turns, angular)
        rows = (shift.displacement, shift.velocity, shift.angular_velocity, motion.centre,
                (shift.angular_velocity @ _CROSS).reshape(-1, 3, 3))
        if len(shift.displacement) > 1:
            rows = tuple(row[self.doll_of] for row in rows)
        displacement, linear, angular_velocity, centre, turning = rows
        turned = np.matmul((state.positions - centre)[:, None, :], turning)[:, 0]
        return State(state.positions + displacement, orientations,
                     state.linear_velocities + linear + turned,
                     angular + angular_velocity)


_CROSS = np.array([[0, 0, 0, 0, 0, 1, 0, -1, 0], [0, 0, -1, 0, 0, 0, 1, 0, 0],
                   [0, 1, 0, -1, 0, 0, 0, 0, 0]], float)
"""(3, 9) takes w to the matrix M with r M = w x r for rows r."""


def _sums_of_points() -> np.ndarray:
    """Matrix (36, 13) that takes all products z_i z_j of z = (r, v), position and velocity of a
    unit mass, to its kinetic energy v v / 2 (1), angular momentum r x v (3), and its inertia
    r r 1 - r r^T (9, Steiner's theorem).
    """
    table = np.zeros((6, 6, 13))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        table[3 + i, 3 + i, 0] = 0.5
        table[j, 3 + k, 1 + i], table[k, 3 + j, 1 + i] = 1, -1
        for other in (j, k):
            table[other, other, 4 + 4 * i] = 1
            table[i, other, 4 + 3 * i + other] = -1
    return table.reshape(36, 13)
