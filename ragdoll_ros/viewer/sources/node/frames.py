"""Frames from what a node publishes with every tick, taken from the topics when a page draws."""
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
from ....recordings.recording import Rods
from ....ros.messages.serialized import deserialize_pose_array
from ....ros.outputs import LATCHED
from ..source import Frame, Wanted
from .hands import RemoteHands
from .pushes import HeardPushes
from .topic import Newest


class Topic(NamedTuple):
    """What a node tells with every tick; ``read`` raises ValueError for what is no such message."""

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
"""By what they tell of; {} stands for the node's name."""


class RemoteFrames:
    """The newest of each topic that is listened to, as a frame of the scene that is known."""

    def __init__(self, node: Node, name: str, hands: RemoteHands) -> None:
        self._node, self._name, self._hands = node, name, hands
        self._lock = threading.Lock()
        self._topics: dict[str, Newest] = {}
        self._values: dict[str, object] = {}
        self._pushes: HeardPushes | None = None
        self._rods: Rods | None = None
        self._frame: Frame | None = None
        self._changes = 0
        """How often a message or a scene came, or a topic went, so far."""
        self._framed = (0, 0)
        """That, and how often a hand was moved, as the frame was made."""
        self._zero_of_poses: tuple[int, float] | None = None
        self.zero: tuple[int, float] | None = None
        """Stamp of time zero, ns, and the pace of stamps that the node has reported last."""
        self.heard = 0.0
        """Instant of the last poses, s of the steady clock."""

    def listen(self, wanted: Wanted) -> None:
        """Subscribe to the topics of what is wanted, and to no others."""
        swings = self._rods is not None and self._rods.count > 0
        on = {'poses': wanted.frames, 'contacts': wanted.contacts, 'angles': wanted.angles,
              'swings': wanted.frames and swings}
        kinds = {kind for kind in TOPICS if on[kind]}
        with self._lock:
            for kind in self._topics.keys() - kinds:
                self._node.destroy_subscription(self._topics.pop(kind).subscription)
                self._values.pop(kind, None)
                self._changes += 1
            for kind in kinds - self._topics.keys():
                topic = TOPICS[kind]
                self._topics[kind] = Newest(self._node, topic.message,
                                            topic.name.format(self._name), topic.qos, topic.raw)

    def begin(self, pushes: HeardPushes) -> None:
        """Go on with the scene of these pushes, from the first poses on that fit it."""
        with self._lock:
            self._pushes, self._rods = pushes, Rods(pushes.scene)
            for kind in ('swings', 'angles'):
                self._values.pop(kind, None)
            self._changes += 1

    @property
    def newest(self) -> Frame | None:
        """Where all is by the last poses that fitted the scene; the same frame if nothing came."""
        with self._lock:
            self._take()
            changes = self._changes, self._hands.moves
            if changes != self._framed and self._pushes is not None and 'poses' in self._values:
                stamp, poses = self._values['poses']
                if len(poses) == len(self._pushes.scene.bones) and np.isfinite(poses).all():
                    self._framed, self._frame = changes, self._frame_of(stamp, poses)
            return self._frame

    def _take(self) -> None:
        """Take what has come; what is no such message, or names others' joints, is left."""
        for kind, topic in self._topics.items():
            message = topic.take()
            if message is None:
                continue
            with contextlib.suppress(ValueError):
                self._values[kind] = TOPICS[kind].read(message, self._pushes and self._pushes.scene)
                self._changes += 1
                if kind == 'poses':
                    # With the time zero that holds for them: a report of another comes before.
                    self._zero_of_poses, self.heard = self.zero, time.monotonic()

    def _frame_of(self, stamp: int, poses: np.ndarray) -> Frame:
        scene = self._pushes.scene
        unknown = np.full((len(poses), 3), np.nan)
        state = State(poses[:, :3], poses[:, 3:], unknown, unknown)
        # Before the first report the node's time zero is not known.
        self.zero = (stamp, 1.0) if self.zero is None else self.zero
        zero, pace = self.zero if self._zero_of_poses is None else self._zero_of_poses
        self._pushes.time = (stamp - zero) / SECOND * pace
        masses, rods = self._values.get('swings'), None
        if masses is not None and len(masses) == self._rods.count:
            rods = self._rods.ends(masses, state)
        return Frame(scene, self._pushes.time, state, self._pushes.pushes,
                     self._hands.held(scene, state), rods, self._values.get('contacts'),
                     self._values.get('angles'))
