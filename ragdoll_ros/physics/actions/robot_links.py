"""The links of a robot as compiled code sees them: joints that they hang on, and their bones."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...model import rotation
from ...model.robot import Robot, RobotJoint
from ...model.scene import Scene
from ..kernels.loaded import links as kernels


def robot_links(scene: Scene, robot: Robot, dolls: Sequence[int]) -> kernels.Links:
    """The links of a robot at its start, which are ``dolls`` (n,) of a scene."""
    above = {joint.child: joint for joint in robot.joints}
    place: dict[str, int] = {}
    joints: list[tuple] = []
    for link in robot.links:
        path: list[RobotJoint] = []
        while link in above and link not in place:
            path.append(above[link])
            link = above[link].parent
        for joint in reversed(path):
            joints.append(_joint(robot, joint, place.get(joint.parent, 0)))
            place[joint.child] = len(joints)
    never = kernels.NEVER
    motions = [(joint.start, 0.0, joint.start, never, never, never, False,
                joint.kind == 'continuous') for joint in robot.driven]
    return kernels.make_links(
        np.array(joints, kernels.LINK_JOINT), np.array(motions, kernels.JOINT_MOTION),
        np.array([place.get(link, 0) for link in robot.links]),
        np.array([np.linalg.norm(scene.dolls[doll].doll.root.shape.half_extents)
                  for doll in dolls]),
        bones_of(scene, dolls))


def bones_of(scene: Scene, dolls: Sequence[int]) -> np.ndarray:
    """The bone (n,) of each link."""
    return np.array([scene.bone_slices[doll].start for doll in dolls])


def _joint(robot: Robot, joint: RobotJoint, parent: int) -> tuple:
    """Fields of the LINK_JOINT of a joint; ``parent``: index of its parent's frame."""
    leader, multiplier, offset = joint.mimic or (joint.name, 1.0, 0.0)
    if joint.kind == 'fixed':
        leader, offset = '', 0.0
    return (parent, robot.indices.get(leader, -1), multiplier, offset, joint.kind == 'prismatic',
            joint.position, joint.orientation,
            rotation.multiply(joint.orientation, (*joint.axis, 0.0)),
            rotation.rotate(joint.orientation, joint.axis))
