"""How far bones are from the ground."""
from __future__ import annotations

import math

import numpy as np

from ..model import rotation
from ..model.ragdoll import Ragdoll
from ..model.scene import Scene
from ..model.shapes import support_distance
from ..model.state import State


class GroundHeights:
    """The simple shapes that all bones of a scene consist of; equal dolls share theirs."""

    def __init__(self, scene: Scene) -> None:
        self._ground, self._count = scene.ground, len(scene.bones)
        dolls = [placement.doll for placement in scene.dolls]
        equal = {id(doll): doll for doll in dolls}
        tables = {key: _parts(doll) for key, doll in equal.items()}
        bones, self._supports, self._positions, self._turns = (
            np.concatenate(rows) for rows in zip(*(tables[id(doll)] for doll in dolls),
                                                 strict=True))
        self._bones = bones + np.repeat([own.start for own in scene.bone_slices],
                                        [len(tables[id(doll)][0]) for doll in dolls])
        self._first = np.searchsorted(self._bones, np.arange(self._count))

    def __call__(self, state: State) -> np.ndarray:
        """Distances (n,) m of the bones' lowest points from the ground; infinity without one."""
        if self._ground is None:
            return np.full(self._count, math.inf)
        normal = np.array(self._ground.normal)
        down = -np.einsum('i,nij->nj', normal, state.rotation_matrices)[self._bones]
        reach = (down * self._positions).sum(axis=1) + support_distance(
            self._supports, np.einsum('pj,pji->pi', down, self._turns))
        return ((state.positions * normal).sum(axis=1) - self._ground.offset
                - np.maximum.reduceat(reach, self._first))


def _parts(doll: Ragdoll) -> tuple[np.ndarray, ...]:
    """Of each of a doll's p simple shapes its bone (p,), its terms (p, 6) m of support_distance,
    and its place (p, 3) m and axes (p, 3, 3) along those of the bone.
    """
    parts = [(index, part) for index, bone in enumerate(doll.bones) for part in bone.shape.parts]
    return (np.array([index for index, _ in parts]),
            np.array([part.shape.support for _, part in parts]),
            np.array([part.position for _, part in parts]),
            rotation.matrix([part.orientation for _, part in parts]))
