"""Forward kinematics of a doll: where its bones are, and how fast, at joint angles and rates.

From the root to the tips; Featherstone, Rigid Body Dynamics Algorithms (2008), chapter 4. The order
of a joint's axes is that of joint_axes(): R = R(first) R(second) R(third).
"""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from . import rotation
from .pose import Pose
from .ragdoll import Bone, Ragdoll, joint_axes


@dataclass(frozen=True)
class BoneMotion:
    """Pose and velocity of a bone in one frame, such as the doll's. In those that bone_motions()
    returns, the root is at rest in its bind pose; in motions of files it moves.
    """

    turn: np.ndarray
    """Quaternion (4,) of the rotation since the bind pose."""
    position: np.ndarray
    """(3,) m, of the centre of mass."""
    velocity: np.ndarray
    """(3,) m/s, of the centre of mass."""
    spin: np.ndarray
    """(3,) rad/s."""

    def pose(self, bone: Bone) -> Pose:
        """The pose of ``bone``, whose motion this is."""
        return Pose(self.position, rotation.multiply(self.turn, np.array(bone.orientation)))


def bone_motions(doll: Ragdoll, angles: Mapping[str, float],
                 rates: Mapping[str, float]) -> dict[str, BoneMotion]:
    """Motion of each bone, by its name, at ``angles``, rad, and ``rates``, rad/s, by the names of
    the angles; those that are not named are zero.
    """
    zero = np.zeros(3)
    found = {doll.root.name: BoneMotion(np.array(rotation.IDENTITY), np.array(doll.root.position),
                                        zero, zero)}
    for joint in doll.joints_depth_first():
        parent, above, child = found[joint.parent], doll.bone(joint.parent), doll.bone(joint.child)
        arm = rotation.rotate(parent.turn, np.subtract(joint.anchor, above.position))
        turn, spin = parent.turn, parent.spin
        for name, axis in zip(joint.angle_names, joint_axes(joint), strict=True):
            spin = spin + rates.get(name, 0.0) * rotation.rotate(turn, axis)
            turn = rotation.multiply(turn, rotation.from_axis_angle(axis, angles.get(name, 0.0)))
        reach = rotation.rotate(turn, np.subtract(child.position, joint.anchor))
        found[joint.child] = BoneMotion(
            turn, parent.position + arm + reach,
            parent.velocity + np.cross(parent.spin, arm) + np.cross(spin, reach), spin)
    return found
