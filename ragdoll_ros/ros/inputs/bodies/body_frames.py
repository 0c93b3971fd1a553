"""Bodies that follow frames of /tf: the parameter ``body_frames``, and what it subscribes to."""
from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.subscription import Subscription

from ....model import errors, rotation
from ....model.pose import Pose
from ....model.scene import SECOND, Scene
from ....model.vectors import unit_vector
from ...messages.convert import from_time
from ...messages.tf import DEPTH, TFMessage
from ...parameters.body_frames import parse_body_frames
from .message_times import LONGEST

TF, TF_STATIC = '/tf', '/tf_static'

CONNECTION_TIME = 1.0
"""s for which a frame may be without a connection to the world frame: its parents may come later.
"""

LATCHED = QoSProfile(depth=DEPTH, durability=DurabilityPolicy.TRANSIENT_LOCAL)

Drive = Callable[[str, Sequence[float], Sequence[float], int], None]
"""Moves a body, by its name, pose (7,) and twist (6,) in the world frame, and their stamp, ns; may
raise a ModelError.
"""

Refuse = Callable[[str, errors.ModelError], None]


class Transform(NamedTuple):
    """Pose of a frame in its ``parent``, valid at ``stamp``, ns."""

    parent: str
    pose: Pose
    stamp: int


class WorldPose(NamedTuple):
    """Pose of a frame in the world frame, valid at ``stamp``, ns."""

    pose: Pose
    stamp: int

    def twist_since(self, last: WorldPose | None) -> np.ndarray:
        """Mean twist (6,) since the ``last`` pose, m/s and rad/s. Zero without a last pose, or if
        that is not older or more than LONGEST older.
        """
        seconds = 0.0 if last is None else (self.stamp - last.stamp) / SECOND
        if last is None or not 0 < seconds <= LONGEST:
            return np.zeros(6)
        turn = rotation.multiply(self.pose.orientation, rotation.inverse(last.pose.orientation))
        return np.concatenate([self.pose.position - last.pose.position,
                               rotation.rotation_vector(turn)]) / seconds


class FrameFollower:
    """Composes the transforms of frames, and moves the bodies that follow these.

    A frame's pose is composed of the latest transform of each frame up to the world frame; nothing
    is interpolated. Its stamp is the latest stamp of these transforms. ``refuse(topic, error)`` is
    called for each wrong transform or frame.
    """

    def __init__(self, drive: Drive, refuse: Refuse) -> None:
        self._drive, self._refuse = drive, refuse
        self._transforms: dict[str, Transform] = {}
        self._last: dict[str, WorldPose] = {}
        self._unconnected: dict[str, int] = {}
        """Stamps, ns, at which frames were first found without a connection to the world."""
        self.frames: dict[str, str] = {}
        """Frame by the name of the body that follows it."""
        self.world = ''

    def follow(self, frames: dict[str, str], world: str) -> None:
        """Move these bodies by these frames; ``world`` is the name of the world frame."""
        if (frames, world) != (self.frames, self.world):
            self.frames, self.world = frames, world
            self._last.clear()
            self._unconnected.clear()

    def on_transforms(self, topic: str, transforms: Iterable[TransformStamped]) -> None:
        """Take transforms and move the bodies that follow them. Each wrong transform is refused;
        the others are taken.
        """
        changed = set()
        for each in transforms:
            try:
                self._transforms[each.child_frame_id] = _transform(each)
                changed.add(each.child_frame_id)
            except errors.ModelError as error:
                self._refuse(topic, error.at(each.child_frame_id))
        for body, frame in self.frames.items():
            chain = self._chain(frame)
            if changed.intersection(chain):
                try:
                    self._move(body, frame, chain)
                except errors.ModelError as error:
                    self._refuse(topic, error.at(frame))

    def _chain(self, frame: str) -> list[str]:
        """List the known frames from ``frame`` upwards, without the world frame."""
        chain: list[str] = []
        while frame in self._transforms and frame != self.world and frame not in chain:
            chain.append(frame)
            frame = self._transforms[frame].parent
        return chain

    def _move(self, body: str, frame: str, chain: Sequence[str]) -> None:
        stamp = max(self._transforms[name].stamp for name in chain)
        top = self._transforms[chain[-1]].parent
        if top != self.world:
            first = self._unconnected.setdefault(frame, stamp)
            if stamp - first > CONNECTION_TIME * SECOND:
                raise errors.WrongForm('parent', top, f'frames up to {self.world}')
            return
        self._unconnected.pop(frame, None)
        pose = Pose()
        for name in chain:
            pose = self._transforms[name].pose.compose(pose)
        last, now = self._last.get(body), WorldPose(pose, stamp)
        if last is not None and now.stamp == last.stamp:
            return  # told again
        self._last[body] = now
        self._drive(body, (*pose.position.tolist(), *pose.orientation.tolist()),
                    now.twist_since(last).tolist(), stamp)


class BodyFrames:
    """Subscriptions to /tf and /tf_static while the parameter ``body_frames`` names a frame.

    ``drive`` and ``refuse`` are those of a FrameFollower.
    """

    def __init__(self, node: Node, drive: Drive, refuse: Refuse) -> None:
        self._node, self._follower = node, FrameFollower(drive, refuse)
        self._subscriptions: list[Subscription] = []
        self._is_told = False

    def configure(self, entries: Sequence[str], scene: Scene, world: str) -> None:
        """Follow the frames of the ``entries`` of body_frames; ``world``: the world frame."""
        frames = parse_body_frames(entries, scene)
        self._follower.follow(frames, world)
        if frames and TFMessage is None and not self._is_told:
            self._is_told = True
            self._node.get_logger().warning(
                'body_frames moves nothing, as tf2_msgs is not installed')
        if bool(frames) == bool(self._subscriptions) or TFMessage is None:
            return
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        self._subscriptions = [self._subscribe(topic, qos) for topic, qos in (
            (TF, QoSProfile(depth=DEPTH)), (TF_STATIC, LATCHED)) if frames]

    def _subscribe(self, topic: str, qos: QoSProfile) -> Subscription:
        take = partial(self._follower.on_transforms, topic)
        return self._node.create_subscription(
            TFMessage, topic, lambda message: take(message.transforms), qos)


def _transform(message: TransformStamped) -> Transform:
    """Convert a message. Raises NotFinite, or NotUnit for a zero quaternion."""
    move, turn, stamp = (message.transform.translation, message.transform.rotation,
                         message.header.stamp)
    position = (move.x, move.y, move.z)
    errors.check_finite('translation', position)
    orientation = unit_vector('rotation', (turn.x, turn.y, turn.z, turn.w),
                              'a quaternion x, y, z, w, not zero', 4)
    return Transform(message.header.frame_id, Pose(np.array(position), np.array(orientation)),
                     from_time(stamp))
