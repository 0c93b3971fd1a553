"""Rods of swings from the positions of their masses."""
from __future__ import annotations

import numpy as np

from ..model import rotation
from ..model.scene import Scene
from ..model.state import State
from ..physics.swing.mount import mount_swings


class Rods:
    """Start of each rod of a scene's swings: on a bone, or the mass before it."""

    def __init__(self, scene: Scene) -> None:
        bones, roots, firsts, free = [], [], [], []
        self.count = 0
        """Masses of all swings."""
        for mount in mount_swings(scene):
            links = len(mount.swing.links)
            bones.append(mount.bone)
            roots.append(mount.root)
            firsts.append(self.count)
            if mount.swing.mode == 'free':
                free += range(self.count, self.count + links)
            self.count += links
        self._bones, self._roots = np.array(bones, int), np.array(roots).reshape(-1, 3)
        self._firsts, self._free = np.array(firsts, int), np.array(free, int)

    def ends(self, masses: np.ndarray, state: State) -> np.ndarray:
        """Both ends (m, 2, 3) m of each rod, from the masses (m, 3) m and the bones' poses.

        Of a free mass, which has no rod, both are its position.
        """
        begins = np.concatenate([masses[:1], masses[:-1]])
        begins[self._firsts] = state.positions[self._bones] + rotation.rotate(
            state.orientations[self._bones], self._roots)
        begins[self._free] = masses[self._free]
        return np.stack([begins, masses], axis=1)
