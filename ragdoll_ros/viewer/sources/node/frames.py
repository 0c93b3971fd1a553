"""Frames from the topics that a node publishes each tick, read when a page draws."""
from __future__ import annotations

import contextlib
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseArray
from rclpy.callback_groups import CallbackGroup
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from visualization_msgs.msg import MarkerArray

from ....model.scene import SECOND, Scene
from ....model.state import State
from ....physics.sensors.impact_arrow import ImpactArrow
from ....recordings.recording import Rods
from ....ros.impacts.markers import to_arrows
from ....ros.messages.convert import from_time
from ....ros.messages.measures import TickMeasures, deserialize_measures
from ....ros.messages.serialized import deserialize_pose_array
from ..recent_impacts import RecentImpacts
from ..source import Frame, RequestedData
from .hands import NodeHands
from .pushes import ObservedPushes

MAX_MESSAGES = 300
"""Messages of a topic that wait to be read: 3 s of ticks, in which a page may draw nothing."""

LOG_PERIOD = 1.0
"""s between two warnings of lost messages of a topic at least."""

QOS = QoSProfile(depth=MAX_MESSAGES)
LATCHED_QOS = QoSProfile(depth=MAX_MESSAGES, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Topic(NamedTuple):
    """A topic of each tick.

    ``read`` gives stamp, ns, and content of a message; it raises ValueError for a malformed one.
    """

    message: type
    name: str
    read: Callable[[object, Scene | None], tuple[int, object]]
    qos: QoSProfile = QOS
    raw: bool = True


def _positions(data: bytes, _: Scene | None) -> tuple[int, np.ndarray]:
    stamp, poses = deserialize_pose_array(data)
    return stamp, poses[:, :3]


def _angles(message: JointState, scene: Scene | None) -> tuple[int, np.ndarray]:
    if scene is None or tuple(message.name) != scene.angle_names:
        raise ValueError('joints of another scene')
    stamp = message.header.stamp
    return from_time(stamp), np.array(message.position)


def _impacts(message: MarkerArray, _: Scene | None) -> tuple[int, tuple[ImpactArrow, ...]]:
    arrows = to_arrows(message)
    if not arrows:
        raise ValueError('no arrows')
    stamp = message.markers[0].header.stamp
    return from_time(stamp), arrows


TOPICS = {'poses': Topic(PoseArray, '{}/poses', lambda data, _: deserialize_pose_array(data),
                         LATCHED_QOS),
          'measures': Topic(DiagnosticArray, '{}/measures',
                            lambda data, _: deserialize_measures(data), LATCHED_QOS),
          'contacts': Topic(PoseArray, '{}/contacts', _positions),
          'swings': Topic(PoseArray, '{}/swings', _positions, LATCHED_QOS),
          'angles': Topic(JointState, 'joint_states', _angles, raw=False),
          'impacts': Topic(MarkerArray, '{}/impacts/markers', _impacts, raw=False)}
"""By content; {} stands for the node's name. The node publishes poses last."""


class NodeFrames:
    """Combines messages of one stamp, of all subscribed topics, into frames of the current scene.

    Poses wait for the measures of their tick, which tell the simulated time and the scene, and for
    that scene. Of the other topics the newest message is used if that of the tick is missing.
    """

    def __init__(self, node: Node, name: str, hands: NodeHands) -> None:
        self._node, self._name, self._hands = node, name, hands
        self._lock = threading.Lock()
        self._topics: dict[str, _NewMessages] = {}
        self._poses: deque[tuple[int, np.ndarray]] = deque(maxlen=MAX_MESSAGES)
        """Stamps and poses that wait for their measures."""
        self._values: dict[str, dict[int, object]] = {}
        """Of the other topics, the content of messages by their stamps."""
        self._latest: dict[str, object] = {}
        """Of each topic, the content that was used last."""
        self._pushes: ObservedPushes | None = None
        self._rods: Rods | None = None
        self._impacts = RecentImpacts()
        self._new_impacts: list[ImpactArrow] = []
        """Since the newest frame: the node publishes them after the poses of their tick."""
        self._checksum = ''
        """Of the scene's text."""
        self._frames: deque[Frame] = deque(maxlen=MAX_MESSAGES)
        """Not taken yet."""
        self._frame: Frame | None = None
        self._run_times: dict[int, int] = {}
        """Latest simulated time, ns, of each of the last runs."""
        self._last: tuple[TickMeasures, np.ndarray] | None = None
        """Of the newest frame."""
        self._is_outdated = False
        """Whether scene or subscriptions have changed since the newest frame."""
        self._moves = 0
        """Count of hand moves at the newest frame."""
        self.last_poses = 0.0
        """When the last poses came, s of the steady clock."""

    def subscribe(self, requested: RequestedData) -> None:
        """Subscribe to the topics of the requested data, and to no others."""
        swings = self._rods is not None and self._rods.count > 0
        needed = {'poses': requested.frames, 'measures': requested.frames,
                  'contacts': requested.contacts, 'angles': requested.angles,
                  'impacts': requested.impacts,
                  'swings': requested.frames and swings}
        kinds = {kind for kind in TOPICS if needed[kind]}
        with self._lock:
            for kind in self._topics.keys() - kinds:
                self._node.destroy_subscription(self._topics.pop(kind).subscription)
                self._values.pop(kind, None)
                self._latest.pop(kind, None)
                self._is_outdated = True
            if not requested.frames:
                self._poses.clear()
            for kind in kinds - self._topics.keys():
                self._topics[kind] = _NewMessages(self._node, TOPICS[kind], self._name)

    def set_scene(self, pushes: ObservedPushes, checksum: str) -> None:
        """Use the scene of ``pushes`` for poses; ``checksum``: of the scene's text on ~/scene."""
        with self._lock:
            self._checksum = checksum
            if self._pushes is pushes:
                return
            self._pushes, self._rods = pushes, Rods(pushes.scene)
            for kind in ('swings', 'angles'):
                self._values.pop(kind, None)
                self._latest.pop(kind, None)
            self._is_outdated = True

    @property
    def newest(self) -> Frame | None:
        """Frame of the last poses that fitted the scene; the same object while nothing changes."""
        with self._lock:
            self._update()
            return self._frame

    def take(self) -> list[Frame]:
        """All frames since the last call, oldest first."""
        with self._lock:
            self._update()
            frames = list(self._frames)
            self._frames.clear()
            return frames

    def _update(self) -> None:
        """Read new messages and make frames of them."""
        scene = self._pushes and self._pushes.scene
        for kind, topic in self._topics.items():
            for message in topic.take():
                # Malformed ones and those of other joints are ignored.
                with contextlib.suppress(ValueError):
                    stamp, value = TOPICS[kind].read(message, scene)
                    self._keep(kind, stamp, value)
        if self._pushes is None:
            return
        for stamp, measures, poses in self._complete_poses():
            if len(poses) == len(scene.bones) and np.isfinite(poses).all():
                self._use(stamp)
                # A late subscription begins with messages that an earlier one may have had.
                if self._is_new(measures):
                    self._add_frame(measures, poses)
        changed = self._is_outdated or self._moves != self._hands.moves
        if changed and self._last is not None and self._last[0].scene == self._checksum:
            self._add_frame(*self._last)

    def _keep(self, kind: str, stamp: int, value: object) -> None:
        if kind == 'poses':
            self._poses.append((stamp, value))
            self.last_poses = time.monotonic()
            return
        if kind == 'impacts':
            self._new_impacts += value
            return
        values = self._values.setdefault(kind, {})
        values.pop(stamp, None)
        values[stamp] = value
        if len(values) > MAX_MESSAGES:
            values.pop(next(iter(values)))
        if kind != 'measures' and not self._poses:
            self._latest[kind], self._is_outdated = value, True

    def _complete_poses(self) -> Iterator[tuple[int, TickMeasures, np.ndarray]]:
        """Stamp, measures and poses of each complete tick of the scene; drop others before."""
        known = {stamp: measures for stamp, measures in self._values.get('measures', {}).items()
                 if measures.scene == self._checksum}
        last = max((k for k, (stamp, _) in enumerate(self._poses) if stamp in known), default=-1)
        for _ in range(last + 1):
            stamp, poses = self._poses.popleft()
            if self._values['measures'].pop(stamp, None) is not None and stamp in known:
                yield stamp, known[stamp], poses

    def _use(self, stamp: int) -> None:
        """Of each topic that has a message with this stamp, make that message the latest one."""
        for kind, values in self._values.items():
            if kind != 'measures' and stamp in values:
                for old in list(values):
                    self._latest[kind] = values.pop(old)
                    if old == stamp:
                        break

    def _is_new(self, measures: TickMeasures) -> bool:
        """Whether measures are later than all before of their run; remember their time."""
        before = self._run_times.pop(measures.run, -1)
        self._run_times[measures.run] = max(before, measures.time)
        if len(self._run_times) > MAX_MESSAGES:
            self._run_times.pop(next(iter(self._run_times)))
        return measures.time > before

    def _add_frame(self, measures: TickMeasures, poses: np.ndarray) -> None:
        scene = self._pushes.scene
        self._last, self._is_outdated, self._moves = (measures, poses), False, self._hands.moves
        unknown = np.full((len(poses), 3), np.nan)
        state = State(poses[:, :3], poses[:, 3:], unknown, unknown)
        self._pushes.set_time(measures.time / SECOND)
        masses, rods = self._latest.get('swings'), None
        if masses is not None and len(masses) == self._rods.count:
            rods = self._rods.ends(masses, state)
        impacts = self._impacts.add(measures.run, self._pushes.time,
                                    self._new_impacts)
        self._new_impacts = []
        work = measures.work_of_pushes + measures.work_of_grabs
        self._frame = Frame(scene, self._pushes.time, state, self._pushes.pushes,
                            self._hands.grabs(scene, state), rods, self._latest.get('contacts'),
                            self._latest.get('angles'), run=measures.run, impacts=impacts,
                            energy=work + measures.energy_excess, work=work)
        self._frames.append(self._frame)


class _NewMessages:
    """Subscribes to a topic of the node ``name`` without an executor.

    An executor wakes for each message, 100 times a second, and goes through all entities of its
    node each time: 0.6 ms, where taking a message costs 10 us, and a page draws only at 60 Hz.
    """

    def __init__(self, node: Node, topic: Topic, name: str) -> None:
        self.subscription = node.create_subscription(
            topic.message, topic.name.format(name), lambda _: None, topic.qos,
            callback_group=_NotExecuted(), raw=topic.raw)
        self._logger = node.get_logger()
        self._number: int | None = None
        """Of the last message: the publisher counts them; another publisher begins at 1."""

    def take(self) -> Iterator[object]:
        """All messages since the last call, bytes if raw."""
        subscription = self.subscription
        for _ in range(MAX_MESSAGES):
            try:
                with subscription.handle:
                    taken = subscription.handle.take_message(subscription.msg_type,
                                                             subscription.raw)
            except InvalidHandle:
                # The other thread has destroyed the subscription.
                return
            if taken is None:
                return
            message, info = taken
            self._warn_of_lost(info['publication_sequence_number'])
            yield message

    def _warn_of_lost(self, number: int | None) -> None:
        """Warn if messages between the last one and the one of this ``number`` were lost.

        None: the middleware does not count messages.
        """
        if None not in (self._number, number) and number > self._number + 1:
            self._logger.warning(
                f'{number - self._number - 1} messages of {self.subscription.topic_name} were '
                'lost: the network or this machine was too slow, and ticks are missing here',
                throttle_duration_sec=LOG_PERIOD)
        self._number = number


class _NotExecuted(CallbackGroup):
    """Entities that no executor waits for."""

    def can_execute(self, entity: object) -> bool:
        return False

    def beginning_execution(self, entity: object) -> bool:
        return False

    def ending_execution(self, entity: object) -> None:
        pass
