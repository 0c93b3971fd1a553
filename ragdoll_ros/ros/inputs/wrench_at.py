"""What a message on ~/wrench_at asks for: wrenches at points of bones.

sensor_msgs/MultiDOFJointState is the one standard message with a name, a point and a wrench.
Gazebo's EntityWrench has no point, mujoco_ros2_control's ExternalWrench is a type of its own.
"""
from __future__ import annotations

import math
from collections.abc import Callable

from geometry_msgs.msg import Vector3
from sensor_msgs.msg import MultiDOFJointState

from ...model import errors
from ...model.push import Push
from ...model.ragdoll import WORLD
from ...model.scene import Scene
from ...model.vectors import Vector

TOPIC = '~/wrench_at'

REACH = 1.001
"""Largest distance of a point, per radius of the bone about its centre of mass: rounding aside, a
force from outside acts at the surface."""

Limit = Callable[[str, Vector3], Vector]
"""Shortens 'force' or 'torque' to its limit."""


def pushes_at(message: MultiDOFJointState, scene: Scene, frame_id: str, duration: float,
              limit: Limit) -> list[tuple[str, Push]]:
    """Channel and push of each bone in ``joint_names``; ``frame_id`` names the world frame.

    ``transforms[i].translation`` is the point, m from the centre of mass, and ``wrench[i]`` force
    and torque: along the world's axes or, if the frame is the bone's, along the bone's. Raises a
    ModelError for a message that is wrong: then none of it is applied.
    """
    frame, names = message.header.frame_id, message.joint_names
    for key in ('transforms', 'wrench'):
        if len(getattr(message, key)) != len(names):
            raise errors.WrongForm(key, len(getattr(message, key)),
                                   f'as many as joint_names, {len(names)}')
    found = []
    for index, (bone, transform, wrench) in enumerate(
            zip(names, message.transforms, message.wrench, strict=True)):
        if bone not in scene.bone_names:
            raise errors.UnknownBone(f'joint_names[{index}]', bone,
                                     errors.one_of(scene.bone_names, bone))
        if frame not in (WORLD, frame_id, bone):
            raise errors.WrongForm('header.frame_id', frame, f'{frame_id} or {bone}')
        point = _point(f'transforms[{index}].translation', transform.translation,
                       scene.bones[scene.bone_index(bone)].shape.half_extents)
        found.append((f'wrench_at {bone}', Push(
            bone, limit(f'wrench[{index}].force', wrench.force),
            limit(f'wrench[{index}].torque', wrench.torque), point, duration,
            local=frame == bone)))
    return found


def _point(path: str, vector: Vector3, half_extents: Vector) -> Vector:
    """Return the point (3,) m. Raises NotFinite, or OutOfRange if it is outside the bone's bounding
    sphere.
    """
    point, radius = (vector.x, vector.y, vector.z), math.hypot(*half_extents)
    errors.check_finite(path, point)
    if math.hypot(*point) > REACH * radius:
        raise errors.OutOfRange(path, point,
                                f'a point of the bone, within {radius:.3g} m of its centre of mass')
    return point
