"""Frames from the topics that a node publishes each tick, read when a page draws."""
from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from geometry_msgs.msg import PoseArray
from rclpy.callback_groups import CallbackGroup
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState

from ....model.scene import SECOND, Scene
from ....model.state import State
from ....recordings.recording import Rods
from ....ros.messages.serialized import deserialize_pose_array
from ....ros.outputs import LATCHED
from ..source import Frame, RequestedData
from .hands import NodeHands
from .pushes import ObservedPushes


class Topic(NamedTuple):
    """A topic of each tick; ``read`` raises ValueError for a malformed message."""

    message: type
    name: str
    read: Callable[[object, Scene | None], object]
    qos: QoSProfile | int = 1
    raw: bool = True


def _positions(data: bytes, _: Scene | None) -> np.ndarray:
    return deserialize_pose_array(data)[1][:, :3]


def _angles(message: JointState, scene: Scene | None) -> np.ndarray:
    if scene is None or tuple(message.name) != scene.angle_names:
        raise ValueError('joints of another scene')
    return np.array(message.position)


TOPICS = {'poses': Topic(PoseArray, '{}/poses', lambda data, _: deserialize_pose_array(data),
                         LATCHED),
          'contacts': Topic(PoseArray, '{}/contacts', _positions),
          'swings': Topic(PoseArray, '{}/swings', _positions),
          'angles': Topic(JointState, 'joint_states', _angles, raw=False)}
"""By content; {} stands for the node's name."""


class NodeFrames:
    """Combines the latest messages of all subscribed topics into a frame of the current scene."""

    def __init__(self, node: Node, name: str, hands: NodeHands) -> None:
        self._node, self._name, self._hands = node, name, hands
        self._lock = threading.Lock()
        self._topics: dict[str, _NewestMessage] = {}
        self._values: dict[str, object] = {}
        self._pushes: ObservedPushes | None = None
        self._rods: Rods | None = None
        self._frame: Frame | None = None
        self._changes = 0
        """Count of messages, scene changes and ended subscriptions."""
        self._frame_changes = (0, 0)
        """That count, and that of hand moves, when the frame was made."""
        self._zero_of_poses: tuple[int, float] | None = None
        self.zero: tuple[int, float] | None = None
        """Stamp at simulated time zero, ns, and simulated time per stamp time, as last reported."""
        self.last_poses = 0.0
        """When the last poses came, s of the steady clock."""

    def subscribe(self, requested: RequestedData) -> None:
        """Subscribe to the topics of the requested data, and to no others."""
        swings = self._rods is not None and self._rods.count > 0
        needed = {'poses': requested.frames, 'contacts': requested.contacts,
                  'angles': requested.angles, 'swings': requested.frames and swings}
        kinds = {kind for kind in TOPICS if needed[kind]}
        with self._lock:
            for kind in self._topics.keys() - kinds:
                self._node.destroy_subscription(self._topics.pop(kind).subscription)
                self._values.pop(kind, None)
                self._changes += 1
            for kind in kinds - self._topics.keys():
                topic = TOPICS[kind]
                self._topics[kind] = _NewestMessage(self._node, topic, self._name)

    def set_scene(self, pushes: ObservedPushes) -> None:
        """Use the scene of these pushes, from the first poses on that fit it."""
        with self._lock:
            self._pushes, self._rods = pushes, Rods(pushes.scene)
            for kind in ('swings', 'angles'):
                self._values.pop(kind, None)
            self._changes += 1

    @property
    def newest(self) -> Frame | None:
        """Frame of the last poses that fitted the scene; the same object while nothing changes."""
        with self._lock:
            self._take_messages()
            changes = self._changes, self._hands.moves
            is_complete = self._pushes is not None and 'poses' in self._values
            if is_complete and changes != self._frame_changes:
                stamp, poses = self._values['poses']
                if len(poses) == len(self._pushes.scene.bones) and np.isfinite(poses).all():
                    self._frame_changes, self._frame = changes, self._frame_of(stamp, poses)
            return self._frame

    def _take_messages(self) -> None:
        """Read new messages; malformed ones and those of other joints are ignored."""
        for kind, topic in self._topics.items():
            message = topic.take()
            if message is None:
                continue
            with contextlib.suppress(ValueError):
                self._values[kind] = TOPICS[kind].read(message, self._pushes and self._pushes.scene)
                self._changes += 1
                if kind == 'poses':
                    # A report of a later time zero may come before the next poses.
                    self._zero_of_poses, self.last_poses = self.zero, time.monotonic()

    def _frame_of(self, stamp: int, poses: np.ndarray) -> Frame:
        scene = self._pushes.scene
        unknown = np.full((len(poses), 3), np.nan)
        state = State(poses[:, :3], poses[:, 3:], unknown, unknown)
        # Before the first report the node's time zero is unknown.
        self.zero = (stamp, 1.0) if self.zero is None else self.zero
        zero, factor = self.zero if self._zero_of_poses is None else self._zero_of_poses
        self._pushes.time = (stamp - zero) / SECOND * factor
        masses, rods = self._values.get('swings'), None
        if masses is not None and len(masses) == self._rods.count:
            rods = self._rods.ends(masses, state)
        return Frame(scene, self._pushes.time, state, self._pushes.pushes,
                     self._hands.grabs(scene, state), rods, self._values.get('contacts'),
                     self._values.get('angles'))


class _NewestMessage:
    """Subscribes to a topic of the node ``name`` without an executor.

    An executor wakes for each message, 100 times a second, and goes through all entities of its
    node each time: 0.6 ms, where taking a message costs 10 us, and a page draws only at 60 Hz.
    """

    def __init__(self, node: Node, topic: Topic, name: str) -> None:
        self.subscription = node.create_subscription(
            topic.message, topic.name.format(name), lambda _: None, topic.qos,
            callback_group=_NotExecuted(), raw=topic.raw)

    def take(self) -> object | None:
        """The latest message since the last call, bytes if raw, at a depth of 1; None if none."""
        subscription = self.subscription
        try:
            with subscription.handle:
                taken = subscription.handle.take_message(subscription.msg_type, subscription.raw)
        except InvalidHandle:
            # The other thread has destroyed the subscription.
            return None
        return None if taken is None else taken[0]


class _NotExecuted(CallbackGroup):
    """Entities that no executor waits for."""

    def can_execute(self, entity: object) -> bool:
        return False

    def beginning_execution(self, entity: object) -> bool:
        return False

    def ending_execution(self, entity: object) -> None:
        pass
