"""How far joints come apart: the distance of an anchor as its two bones see it."""
from __future__ import annotations

import numpy as np

from ..model.scene import Scene
from ..model.state import State


class JointGap:
    """Anchors of all j joints of a scene, along the axes of the two bones each ties."""

    def __init__(self, scene: Scene) -> None:
        bones, points = [], []
        for placement, own in zip(scene.dolls, scene.bone_slices, strict=True):
            index = {bone.name: i for i, bone in enumerate(placement.doll.bones, own.start)}
            for joint in placement.doll.joints:
                pair = [placement.doll.bone(name) for name in (joint.parent, joint.child)]
                bones.append([index[bone.name] for bone in pair])
                points.append([bone.pose.inward(joint.anchor) for bone in pair])
        self._bones = np.array(bones, int).reshape(-1, 2)
        self._points = np.array(points).reshape(-1, 2, 3)

    def gaps(self, state: State) -> np.ndarray:
        """Distances (j,) m, joint by joint as the dolls list them."""
        seen = state.poses(self._bones).outward(self._points)
        return np.linalg.norm(seen[:, 0] - seen[:, 1], axis=-1)
