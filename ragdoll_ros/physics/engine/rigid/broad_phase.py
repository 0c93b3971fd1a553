"""Broad phase: pairs of dolls whose bones' bounding spheres, swept over time, overlap."""
import numpy as np

from ....model.scene import Scene
from ...kernels.loaded import sweep_and_prune

NO_PAIRS = np.zeros((0, 2), np.int64)


class BroadPhase:
    """Sweep and prune along x; see kernels/collision/sweep_and_prune.py."""

    def __init__(self, scene: Scene, reach: np.ndarray) -> None:
        first = np.array([*(own.start for own in scene.bone_slices), len(scene.bones)])
        ground = scene.ground
        normal, offset = ((0, 0, 1), -np.inf) if ground is None else (ground.normal, ground.offset)
        self._dolls = sweep_and_prune.make_dolls(first, np.ascontiguousarray(reach), normal, offset)
        self._found = np.zeros((4 * len(scene.dolls), 2), np.int64)

    def pairs(self, states: np.ndarray, ahead: float, moving: np.ndarray, yielding: np.ndarray,
              clusters: np.ndarray) -> np.ndarray:
        """Pairs (k, 2) of dolls that may touch within ``ahead`` s, sorted, of which one or both are
        ``moving`` (d,), and one or both ``yielding`` (d,). ``states`` (n, 13) of all bones;
        ``clusters`` (d,): cluster index of each doll.
        """
        count = sweep_and_prune.find_pairs(self._dolls, states, moving, yielding, clusters, ahead,
                                           self._found)
        if count > len(self._found):
            self._found = np.zeros((2 * count, 2), np.int64)
            return self.pairs(states, ahead, moving, yielding, clusters)
        if not count:
            return NO_PAIRS
        found = self._found[:count]
        return found[np.lexsort((found[:, 1], found[:, 0]))]
