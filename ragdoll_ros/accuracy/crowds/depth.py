"""Penetration depths of bones by MuJoCo's distance functions, independent of all engines."""
import itertools

import numpy as np

from ...files.mjcf import to_mjcf
from ...model import rotation
from ...model.scene import Scene
from ..trajectory import Trajectory

SEPARATED = 1e-3
"""m: a pair that overlaps at the start counts once its depth falls to this."""

SEARCH_DISTANCE = 0.01
"""m: larger distances are not computed."""


class BoneDepth:
    """Penetration depths of all pairs of a scene's bones that may collide."""

    def __init__(self, scene: Scene) -> None:
        import mujoco
        self._mujoco = mujoco
        self._model = mujoco.MjModel.from_xml_string(to_mjcf(scene))
        self._data = mujoco.MjData(self._model)
        bodies = [self._model.body(name).id for name in scene.bone_names]
        self._geoms = [np.flatnonzero(self._model.geom_bodyid == body) for body in bodies]
        self._bones = np.repeat(np.arange(len(bodies)), [len(own) for own in self._geoms])
        own = np.concatenate(self._geoms)
        self._own, self._places = own, self._model.geom_pos[own]
        self._turns = self._model.geom_quat[own][:, [1, 2, 3, 0]]
        self._radii = np.array([np.linalg.norm(bone.shape.half_extents) for bone in scene.bones])
        apart = {frozenset(scene.bone_index(scene.qualified(placement, name)) for name in pair)
                 for placement in scene.dolls for pair in placement.doll.excluded_pairs}
        pairs = itertools.combinations(range(len(bodies)), 2) if scene.self_collision else ()
        self._pairs = np.array([pair for pair in pairs if frozenset(pair) not in apart],
                               int).reshape(-1, 2)

    def depths(self, positions: np.ndarray, orientations: np.ndarray) -> np.ndarray:
        """Depth of each pair, (pairs,) m, at poses (n, 3) and (n, 4); 0 without penetration."""
        a, b = self._pairs.T
        far = np.linalg.norm(positions[a] - positions[b], axis=1) > self._radii[a] + self._radii[b]
        found = np.zeros(len(self._pairs))
        if not far.all():
            self._pose(positions, orientations)
        for index in np.flatnonzero(~far):
            geoms = itertools.product(*(self._geoms[bone] for bone in self._pairs[index]))
            found[index] = max(0.0, *(-self._mujoco.mj_geomDistance(
                self._model, self._data, int(one), int(other), SEARCH_DISTANCE, None)
                for one, other in geoms))
        return found

    def deepest(self, trajectory: Trajectory) -> float:
        """Largest depth of any pair, m; a pair that overlaps at the start counts once it has
        separated.
        """
        return _deepest(self._over_time(trajectory))

    def after_separation(self, trajectory: Trajectory) -> tuple[Trajectory, float]:
        """The part after all pairs that overlap at the start have separated, and its deepest()."""
        found = self._over_time(trajectory)
        begin = int((found <= SEPARATED).argmax(axis=0).max(initial=0))
        return trajectory.part(slice(begin, None)), _deepest(found[begin:])

    def _over_time(self, trajectory: Trajectory) -> np.ndarray:
        """Depths (t, pairs), m."""
        return np.array([self.depths(positions, orientations) for positions, orientations
                         in zip(trajectory.positions, trajectory.orientations, strict=True)])

    def _pose(self, positions: np.ndarray, orientations: np.ndarray) -> None:
        """Set the poses of all geoms; MuJoCo's quaternions are w, x, y, z."""
        turns = orientations[self._bones]
        self._data.geom_xpos[self._own] = positions[self._bones] + rotation.rotate(
            turns, self._places)
        self._data.geom_xmat[self._own] = rotation.matrix(
            rotation.multiply(turns, self._turns)).reshape(-1, 9)


def _deepest(found: np.ndarray) -> float:
    """Largest of depths (t, pairs), m; a pair that overlaps at the start counts once it has
    separated.
    """
    counts = np.maximum.accumulate(found <= SEPARATED, axis=0)
    return float(found[counts].max(initial=0.0))
