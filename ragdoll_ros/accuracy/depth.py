"""How deep bones are in each other, by a judge that moves none of them: MuJoCo's distances."""
from __future__ import annotations

import itertools

import numpy as np

from ..files.mjcf import to_mjcf
from ..model import rotation
from ..model.scene import Scene
from .trajectory import Trajectory

APART = 1e-3
"""m: a pair that starts deeper in each other counts from when it is no deeper than this."""


class BoneDepth:
    """Depths of all pairs of a scene's bones that may collide: those without a joint between."""

    def __init__(self, scene: Scene) -> None:
        import mujoco
        self._mujoco = mujoco
        self._model = mujoco.MjModel.from_xml_string(to_mjcf(scene))
        self._data = mujoco.MjData(self._model)
        self._geoms = np.array([self._model.geom(name).id for name in scene.bone_names])
        self._radii = np.array([np.linalg.norm(bone.shape.half_extents) for bone in scene.bones])
        jointed = {frozenset(scene.bone_index(scene.qualified(placement, name))
                             for name in (joint.parent, joint.child))
                   for placement in scene.dolls for joint in placement.doll.joints}
        self._pairs = np.array([pair for pair in itertools.combinations(range(len(self._radii)), 2)
                                if frozenset(pair) not in jointed], int).reshape(-1, 2)

    def depths(self, positions: np.ndarray, orientations: np.ndarray) -> np.ndarray:
        """Of each pair, m, at poses (n, 3) and (n, 4); 0 where they are apart."""
        a, b = self._pairs.T
        far = np.linalg.norm(positions[a] - positions[b], axis=1) > self._radii[a] + self._radii[b]
        self._data.geom_xpos[self._geoms] = positions
        self._data.geom_xmat[self._geoms] = rotation.matrix(orientations).reshape(-1, 9)
        found = np.zeros(len(self._pairs))
        for index in np.flatnonzero(~far):
            first, second = self._geoms[self._pairs[index]]
            found[index] = max(0.0, -self._mujoco.mj_geomDistance(
                self._model, self._data, int(first), int(second), 0.01, None))
        return found

    def deepest(self, trajectory: Trajectory) -> float:
        """Largest depth of any pair, m, each from when it first was apart."""
        worst, counts = 0.0, np.zeros(len(self._pairs), bool)
        for positions, orientations in zip(trajectory.positions, trajectory.orientations,
                                           strict=True):
            found = self.depths(positions, orientations)
            counts |= found <= APART
            worst = max(worst, float(found[counts].max(initial=0.0)))
        return worst
