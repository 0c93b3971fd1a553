"""Conversion of arrays to messages, field by field.

Most messages of a tick use serialized templates instead (serialized.py), which are traced from
these functions.
"""
from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from builtin_interfaces.msg import Duration, Time
from geometry_msgs.msg import Point, Pose, PoseArray, Transform, Twist, Vector3
from sensor_msgs.msg import Imu, JointState, MultiDOFJointState
from std_msgs.msg import Header

from ...model import rotation
from ...model.scene import SECOND, Scene
from ...model.state import State
from ...physics.swing.pose import SwingState

if TYPE_CHECKING:  # else the page, which imports this file, would load an engine
    from ...physics.engine.protocol import Contacts
    from ...physics.sensors.imu import ImuErrors


def count_masses(scene: Scene) -> int:
    """Number of point masses of all swings of a scene."""
    return sum(len(swing.links) for placement in scene.dolls for swing in placement.doll.swings)


def poses_of(state: State | SwingState) -> np.ndarray:
    """Poses (n, 7) of bones or of swings' masses, world frame: position m, quaternion xyzw."""
    if isinstance(state, State):
        return state.rows[:, :7]
    return np.concatenate([state.positions, state.orientations], axis=1)


def contact_poses(contacts: Contacts) -> np.ndarray:
    """Poses (c, 7) of contacts, world frame: position m, shortest rotation of x to the normal."""
    x, y, z = contacts.normals.T
    quaternions = np.stack([np.zeros_like(x), -z, y, 1 + x], axis=1)
    quaternions[1 + x < 1e-15] = (0, 0, 1, 0)
    return np.concatenate([contacts.positions, rotation.normalized(quaternions)], axis=1)


def twists_of(state: State) -> np.ndarray:
    """Twists (n, 6), world frame: linear m/s, angular rad/s."""
    return state.rows[:, 7:]


def to_time(nanoseconds: int) -> Time:
    """Time from ns."""
    seconds, nanoseconds = divmod(nanoseconds, 1_000_000_000)
    return Time(sec=seconds, nanosec=nanoseconds)


def from_time(stamp: Time) -> int:
    """Nanoseconds of a Time."""
    return stamp.sec * SECOND + stamp.nanosec


def to_duration(nanoseconds: int) -> Duration:
    """Duration from ns."""
    seconds, nanoseconds = divmod(nanoseconds, 1_000_000_000)
    return Duration(sec=seconds, nanosec=nanoseconds)


def to_header(stamp: int, frame: str) -> Header:
    """Header with a stamp in ns."""
    return Header(stamp=to_time(stamp), frame_id=frame)


def to_point(values: np.ndarray) -> Point:
    """Point from (3,) m."""
    x, y, z = map(float, values)
    return Point(x=x, y=y, z=z)


def to_vector(values: np.ndarray) -> Vector3:
    """Vector3 from (3,)."""
    x, y, z = map(float, values)
    return Vector3(x=x, y=y, z=z)


def to_pose(row: Sequence[float]) -> Pose:
    """Pose from 7 numbers: position m, quaternion xyzw."""
    pose = Pose()
    p, q = pose.position, pose.orientation
    p.x, p.y, p.z, q.x, q.y, q.z, q.w = row
    return pose


def to_transform(row: Sequence[float]) -> Transform:
    """Transform from 7 numbers: translation m, quaternion xyzw."""
    transform = Transform()
    t, q = transform.translation, transform.rotation
    t.x, t.y, t.z, q.x, q.y, q.z, q.w = row
    return transform


def to_twist(row: Sequence[float]) -> Twist:
    """Twist from 6 numbers: linear m/s, angular rad/s."""
    twist = Twist()
    v, w = twist.linear, twist.angular
    v.x, v.y, v.z, w.x, w.y, w.z = row
    return twist


def to_pose_array(frame: str, stamp: int, poses: np.ndarray) -> PoseArray:
    """PoseArray of poses (n, 7)."""
    return PoseArray(header=to_header(stamp, frame), poses=[to_pose(row) for row in poses.tolist()])


def to_multi_dof(frame: str, names: tuple[str, ...], stamp: int, poses: np.ndarray,
                 twists: np.ndarray) -> MultiDOFJointState:
    """MultiDOFJointState of poses (n, 7) and twists (n, 6) of the named bones."""
    return MultiDOFJointState(
        header=to_header(stamp, frame), joint_names=list(names),
        transforms=[to_transform(row) for row in poses.tolist()],
        twist=[to_twist(row) for row in twists.tolist()])


def to_imu(frame: str, flaws: ImuErrors, stamp: int, rate: np.ndarray, force: np.ndarray) -> Imu:
    """Make an Imu message (data_raw of REP 145, no orientation) of angular rate (3,) rad/s and
    specific force (3,) m/s^2 in the sensor's ``frame``. Without noise the covariances are zero,
    which means unknown.
    """
    message = Imu(header=to_header(stamp, frame), angular_velocity=to_vector(rate),
                  linear_acceleration=to_vector(force))
    message.orientation_covariance[0] = -1.0
    message.angular_velocity_covariance[::4] = flaws.noise_rate ** 2
    message.linear_acceleration_covariance[::4] = flaws.noise_acceleration ** 2
    return message


def to_joint_state(frame: str, names: tuple[str, ...], stamp: int, angles: np.ndarray,
                   rates: np.ndarray) -> JointState:
    """JointState of joint angles (k,) rad and their rates (k,) rad/s."""
    return JointState(header=to_header(stamp, frame), name=list(names), position=angles.tolist(),
                      velocity=rates.tolist())
