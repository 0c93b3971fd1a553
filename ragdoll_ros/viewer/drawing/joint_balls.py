"""Balls at the joints, which let the bones of a doll look like one body."""
from __future__ import annotations

import numpy as np

from ...model.ragdoll import Bone
from ...model.scene import Scene
from ...model.shapes import Part, Sphere

MOST = 100
"""Number of joints of a scene above which no balls are drawn: each costs the page half as much as a
bone when it moves, .7 kB/s, and in a crowd they are too small to be seen."""

OVERLAP = 1.25
"""Radius of a ball relative to the gap between joint and bone that it bridges."""

SHARE, LARGEST = 0.8, 2.0
"""Smallest and largest radius, relative to the smallest half extent of both bones."""


def joint_balls(scene: Scene) -> list[tuple[int, int, Part]]:
    """List for each ball the index of the parent bone, in whose frame the ball is, the index of the
    child, and the ball.

    A joint far from one of its bones has none, nor has a scene with more than MOST joints.
    """
    if sum(len(placement.doll.joints) for placement in scene.dolls) > MOST:
        return []
    balls = []
    for placement in scene.dolls:
        for joint in placement.doll.joints:
            pair = [placement.doll.bone(name) for name in (joint.parent, joint.child)]
            anchor = np.array(joint.anchor)
            least = min(min(bone.shape.half_extents) for bone in pair)
            radius = max(SHARE * least, *(OVERLAP * _gap(bone, anchor) for bone in pair))
            if radius <= LARGEST * least:
                parent, child = (scene.bone_index(scene.qualified(placement, bone.name))
                                 for bone in pair)
                balls.append((parent, child, Part(
                    Sphere(radius), pair[0].pose.apply_inverse(anchor).tolist())))
    return balls


def _gap(bone: Bone, point: np.ndarray) -> float:
    """Distance, m, of a point (3,) m of the doll's frame from the box around a bone."""
    local = bone.pose.apply_inverse(point)
    return float(np.linalg.norm(np.maximum(np.abs(local) - bone.shape.half_extents, 0.0)))
