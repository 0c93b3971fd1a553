"""From states to messages, in the plain way: every message from scratch, field by field.

What runs each tick is packed.Packed, which takes these functions as its model.
"""
from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Pose, PoseArray, Quaternion, Transform, Twist, Vector3
from sensor_msgs.msg import Imu, JointState, MultiDOFJointState
from std_msgs.msg import Header

from ...model import rotation
from ...model.scene import Scene
from ...model.state import State
from ...physics.swing.pose import SwingState

if TYPE_CHECKING:  # else the page, which reads this file, would load an engine
    from ...physics.engine.protocol import Contacts
    from ...physics.sensors.imu import ImuErrors


def count_masses(scene: Scene) -> int:
    """How many point masses all swings of a scene have."""
    return sum(len(swing.links) for placement in scene.dolls for swing in placement.doll.swings)


def poses_of(state: State | SwingState) -> np.ndarray:
    """Poses (n, 7) of bones or of swings' masses: position m, orientation x, y, z, w."""
    if isinstance(state, State):
        return state.rows[:, :7]
    return np.concatenate([state.positions, state.orientations], axis=1)


def contact_poses(contacts: Contacts) -> np.ndarray:
    """Poses (c, 7) of contacts: position m, and the smallest rotation of x to the normal."""
    x, y, z = contacts.normals.T
    turns = np.stack([np.zeros_like(x), -z, y, 1 + x], axis=1)
    turns[1 + x < 1e-15] = (0, 0, 1, 0)
    return np.concatenate([contacts.positions, rotation.normalized(turns)], axis=1)


def twists_of(state: State) -> np.ndarray:
    """Twists (n, 6) in the world frame: linear m/s, angular rad/s."""
    return state.rows[:, 7:]


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


def to_pose(row: Sequence[float]) -> Pose:
    """A pose from 7 numbers: position m, orientation x, y, z, w."""
    pose = Pose()
    p, q = pose.position, pose.orientation
    p.x, p.y, p.z, q.x, q.y, q.z, q.w = row
    return pose


def to_transform(row: Sequence[float]) -> Transform:
    """A transform from 7 numbers: translation m, rotation x, y, z, w."""
    transform = Transform()
    t, q = transform.translation, transform.rotation
    t.x, t.y, t.z, q.x, q.y, q.z, q.w = row
    return transform


def to_twist(row: Sequence[float]) -> Twist:
    """A twist from 6 numbers: linear m/s, angular rad/s."""
    twist = Twist()
    v, w = twist.linear, twist.angular
    v.x, v.y, v.z, w.x, w.y, w.z = row
    return twist


def to_pose_array(frame: str, stamp: int, poses: np.ndarray) -> PoseArray:
    """Poses (n, 7)."""
    return PoseArray(header=to_header(stamp, frame), poses=[to_pose(row) for row in poses.tolist()])


def to_multi_dof(frame: str, names: tuple[str, ...], stamp: int, poses: np.ndarray,
                 twists: np.ndarray) -> MultiDOFJointState:
    """Poses (n, 7) and twists (n, 6) with the bones' names."""
    return MultiDOFJointState(
        header=to_header(stamp, frame), joint_names=list(names),
        transforms=[to_transform(row) for row in poses.tolist()],
        twist=[to_twist(row) for row in twists.tolist()])


def to_imu(frame: str, flaws: ImuErrors, stamp: int, rate: np.ndarray, force: np.ndarray) -> Imu:
    """Angular rate (3,) rad/s and specific force (3,) m/s^2 of a sensor, in its ``frame``: data_raw
    of REP 145, which measures no orientation. Without noise the covariance is unknown.
    """
    message = Imu(header=to_header(stamp, frame), angular_velocity=to_vector(rate),
                  linear_acceleration=to_vector(force))
    message.orientation_covariance[0] = -1.0
    message.angular_velocity_covariance[::4] = flaws.noise_rate ** 2
    message.linear_acceleration_covariance[::4] = flaws.noise_acceleration ** 2
    return message


def to_joint_state(frame: str, names: tuple[str, ...], stamp: int, angles: np.ndarray,
                   rates: np.ndarray) -> JointState:
    """Joint angles (k,) rad and their rates (k,) rad/s, with their names."""
    return JointState(header=to_header(stamp, frame), name=list(names), position=angles.tolist(),
                      velocity=rates.tolist())
