"""From states to messages, in the plain way: every message from scratch, field by field.

What runs each tick is packed.Packed, which takes these functions as its model.
"""
from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Pose, PoseArray, Quaternion, Transform, Twist, Vector3
from sensor_msgs.msg import JointState, MultiDOFJointState
from std_msgs.msg import Header

from ..model import rotation
from ..model.state import State
from ..physics.swing.pose import SwingState

if TYPE_CHECKING:  # else the page, which reads this file, would load an engine
    from ..physics.engine.protocol import Contact


def poses_of(state: State | SwingState) -> np.ndarray:
    """Poses (n, 7) of bones or of swings' masses: position m, orientation x, y, z, w."""
    return np.concatenate([state.positions, state.orientations], axis=1)


def contact_poses(contacts: Sequence[Contact]) -> np.ndarray:
    """Poses (c, 7) of contacts: position m, and a rotation of x to the normal."""
    x = np.array([1.0, 0, 0])
    return np.array([(*contact.position, *rotation.shortest_arc(x, contact.normal))
                     for contact in contacts]).reshape(-1, 7)


def twists_of(state: State) -> np.ndarray:
    """Twists (n, 6) in the world frame: linear m/s, angular rad/s."""
    return np.concatenate([state.linear_velocities, state.angular_velocities], axis=1)


def to_time(nanoseconds: int) -> Time:
    """A stamp from ns."""
    seconds, rest = divmod(nanoseconds, 1_000_000_000)
    return Time(sec=seconds, nanosec=rest)


def to_header(stamp: int, frame: str) -> Header:
    """A header from a stamp in ns."""
    return Header(stamp=to_time(stamp), frame_id=frame)


def to_point(values: np.ndarray) -> Point:
    """A point from (3,) m."""
    x, y, z = map(float, values)
    return Point(x=x, y=y, z=z)


def to_vector(values: np.ndarray) -> Vector3:
    """A vector from (3,)."""
    x, y, z = map(float, values)
    return Vector3(x=x, y=y, z=z)


def to_quaternion(values: np.ndarray) -> Quaternion:
    """A quaternion from (4,) x, y, z, w."""
    x, y, z, w = map(float, values)
    return Quaternion(x=x, y=y, z=z, w=w)


def to_pose_array(frame: str, stamp: int, poses: np.ndarray) -> PoseArray:
    """Poses (n, 7)."""
    return PoseArray(header=to_header(stamp, frame), poses=[
        Pose(position=to_point(row[:3]), orientation=to_quaternion(row[3:])) for row in poses])


def to_multi_dof(frame: str, names: tuple[str, ...], stamp: int, poses: np.ndarray,
                 twists: np.ndarray) -> MultiDOFJointState:
    """Poses (n, 7) and twists (n, 6) with the bones' names."""
    return MultiDOFJointState(
        header=to_header(stamp, frame), joint_names=list(names),
        transforms=[Transform(translation=to_vector(row[:3]), rotation=to_quaternion(row[3:]))
                    for row in poses],
        twist=[Twist(linear=to_vector(row[:3]), angular=to_vector(row[3:])) for row in twists])


def to_joint_state(frame: str, names: tuple[str, ...], stamp: int,
                   angles: np.ndarray) -> JointState:
    """Joint angles (k,) rad with their names."""
    return JointState(header=to_header(stamp, frame), name=list(names), position=angles.tolist())
