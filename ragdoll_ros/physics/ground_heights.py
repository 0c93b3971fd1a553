"""Distances of bones from the ground, and gaps between the anchors of joints."""
from __future__ import annotations

import math

import numpy as np

from ..model import rotation
from ..model.ragdoll import Ragdoll
from ..model.scene import Scene
from ..model.shapes import support_distance
from ..model.state import State


class GroundHeights:
    """Computes the height of each bone's lowest point; equal dolls share their shape tables."""

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
        """Height (n,) m of each bone's lowest point above the ground; infinite without ground."""
        if self._ground is None:
            return np.full(self._count, math.inf)
        normal = np.array(self._ground.normal)
        down = -np.einsum('i,nij->nj', normal, state.rotation_matrices)[self._bones]
        reach = (down * self._positions).sum(axis=1) + support_distance(
            self._supports, np.einsum('pj,pji->pi', down, self._turns))
        return ((state.positions * normal).sum(axis=1) - self._ground.offset
                - np.maximum.reduceat(reach, self._first))


def _parts(doll: Ragdoll) -> tuple[np.ndarray, ...]:
    """Bone index (p,), arguments (p, 6) m of support_distance, position (p, 3) m and rotation
    matrix (p, 3, 3) in the bone's frame, of each of a doll's p convex shapes.
    """
    parts = [(index, part) for index, bone in enumerate(doll.bones) for part in bone.shape.parts]
    return (np.array([index for index, _ in parts]),
            np.array([part.shape.support_terms for _, part in parts]),
            np.array([part.position for _, part in parts]),
            rotation.matrix([part.orientation for _, part in parts]))


class JointGap:
    """Computes the distances between the two anchors of each of a scene's j joints."""

    def __init__(self, scene: Scene) -> None:
        bones, points = [], []
        for placement, own in zip(scene.dolls, scene.bone_slices, strict=True):
            index = {bone.name: i for i, bone in enumerate(placement.doll.bones, own.start)}
            for joint in placement.doll.joints:
                pair = [placement.doll.bone(name) for name in (joint.parent, joint.child)]
                bones.append([index[bone.name] for bone in pair])
                points.append([bone.pose.apply_inverse(joint.anchor) for bone in pair])
        self._bones = np.array(bones, int).reshape(-1, 2)
        self._points = np.array(points).reshape(-1, 2, 3)

    def gaps(self, state: State) -> np.ndarray:
        """Distances (j,) m between anchors, in the dolls' order of joints."""
        seen = state.poses(self._bones).apply(self._points)
        return np.linalg.norm(seen[:, 0] - seen[:, 1], axis=-1)
