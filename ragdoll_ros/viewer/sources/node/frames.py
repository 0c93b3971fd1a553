"""Frames from the topics that a node publishes each tick, read when a page draws."""
from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from geometry_msgs.msg import PoseArray
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState

from ....model.scene import SECOND, Scene
from ....model.state import State
from ....recordings.rods import Rods
from ....ros.messages.serialized import deserialize_pose_array
from ....ros.outputs import LATCHED
from ..source import Frame, RequestedData
from .hands import NodeHands
from .newest_message import NewestMessage
from .observed_pushes import ObservedPushes


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
        self._topics: dict[str, NewestMessage] = {}
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
                self._topics[kind] = NewestMessage(self._node, topic.message,
                                            topic.name.format(self._name), topic.qos, topic.raw)

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
