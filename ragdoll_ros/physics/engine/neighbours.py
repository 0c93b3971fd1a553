"""Which dolls may meet soon: a list that is made anew only when they have moved far enough."""
from __future__ import annotations

import numpy as np

from ...model.scene import Scene
from ...model.state import State
from ..kernels.system import System

AHEAD = 0.05
"""s that the list looks ahead."""

SPARE = 0.05
"""m that it looks farther."""


class Neighbours:
    """Pairs of geoms of dolls whose surrounding balls are near each other (Verlet's list)."""

    def __init__(self, scene: Scene, system: System) -> None:
        self._own = scene.bone_slices
        owner = np.repeat(scene.doll_of_bone, [len(bone.shape.parts) for bone in scene.bones])
        self._geoms = [np.flatnonzero(owner == doll) for doll in range(len(scene.dolls))]
        reach = np.zeros(len(scene.bones))
        np.maximum.at(reach, system.tree['bone'][system.geoms['bone']], system.geoms['reach'])
        self._reach = reach
        self.forget()

    def forget(self) -> None:
        """Make the list anew next time."""
        self._spare = -1.0

    def update(self, state: State, duration: float) -> np.ndarray | None:
        """Pairs (p, 2) of geoms of different dolls that may meet within ``duration`` s; None: those
        that were given last.
        """
        centres = np.array([state.positions[own].mean(axis=0) for own in self._own])
        speeds = np.linalg.norm(state.linear_velocities, axis=1) + self._reach * np.linalg.norm(
            state.angular_velocities, axis=1)
        radii = np.array([
            (np.linalg.norm(state.positions[own] - centre, axis=1) + self._reach[own]).max()
            for own, centre in zip(self._own, centres, strict=True)])
        fastest = np.array([speeds[own].max() for own in self._own])
        if self._spare >= 0:
            moved = np.linalg.norm(centres - self._centres, axis=1) + radii - self._radii
            if (moved + fastest * duration < self._margins).all():
                return None
        margins = fastest * max(AHEAD, 2 * duration) + SPARE
        self._spare, self._centres, self._radii, self._margins = 1.0, centres, radii, margins
        wide = radii + margins
        apart = np.linalg.norm(centres[:, None] - centres[None], axis=2)
        near = np.argwhere(np.triu(apart < wide[:, None] + wide[None], 1))
        return np.array([(a, b) for one, other in near for a in self._geoms[one]
                         for b in self._geoms[other]], np.int64).reshape(-1, 2)
