"""Publishers below /humans/bodies (REP 155, draft), where hri_msgs is installed."""
from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from rclpy.node import Node
from rclpy.publisher import Publisher
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from ...model.per_doll import PerDoll
from ...model.scene import Scene
from ..latched_topic import LATCHED
from ..messages.convert import to_header, to_joint_state
from ..messages.serialized import SerializedTemplate
from ..messages.tf import DEPTH, TFMessage, to_tf
from .body import Body, Person, bodies

if TYPE_CHECKING:
    from ...physics.simulation import Simulation

try:
    from hri_msgs.msg import IdsList
except ImportError as error:  # not on PyPI, which has the rest of ROS
    IdsList, MISSING = None, str(error)

MAX_BODIES = 50
"""Largest number of tracked bodies: each has two topics of its own."""


class BodyPublishers(NamedTuple):
    """A body with the publishers of its joints and of its URDF."""

    body: Body
    joints: Publisher
    urdf: Publisher
    template: SerializedTemplate


class Humans:
    """Publishes the persons of a scene: ids, joint states, URDFs and, with tf2_msgs, frames."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._bodies: list[BodyPublishers] = []
        self._persons = PerDoll(Person.of)
        self._is_told = False
        self._tracked: Publisher | None = None
        self._tf: Publisher | None = None
        self.status = ''
        """For /diagnostics: the ids, or why nothing is published; empty without persons."""

    def prepare(self, scene: Scene) -> list[Body]:
        """Return the persons of a scene, MAX_BODIES at most, without hri_msgs only the first. This
        may run beside the ticks.
        """
        self._persons.keep(placement.doll for placement in scene.dolls)
        # One is enough to say that it is not published.
        return bodies(scene, 1 if IdsList is None else MAX_BODIES, self._persons)

    def set_scene(self, found: list[Body], frame: str, publish_tf: str) -> None:
        """Publish the ids of the persons ``found``, and the URDFs of those that are new; destroy
        the publishers of others. ``frame`` names the world frame.
        """
        self._frame, self.status = frame, ', '.join(body.id for body in found)
        if found and IdsList is None:
            self.status = f'not published, as hri_msgs is not installed: {MISSING}'
            if not self._is_told:
                self._is_told = True
                self._node.get_logger().info(f'/humans is {self.status}')
            return
        self._set_common(bool(found), publish_tf != 'none' and TFMessage is not None)
        before = {(each.body.id, each.body.urdf): each for each in self._bodies}
        self._bodies = []
        for body in found:
            kept = before.pop((body.id, body.urdf), None)
            self._bodies.append(kept._replace(body=body) if kept else self._created(body))
        for each in before.values():
            self._node.destroy_publisher(each.joints)
            self._node.destroy_publisher(each.urdf)
        if found:
            self._tracked.publish(IdsList(header=to_header(0, self._frame),
                                          ids=[body.id for body in found]))

    @property
    def has_subscribers(self) -> bool:
        """Whether somebody listens to what is published with each tick."""
        return any(publisher.get_subscription_count() for publisher in (
            *(each.joints for each in self._bodies), *filter(None, (self._tracked, self._tf))))

    def publish(self, simulation: Simulation, stamp: int) -> None:
        """Publish ids, joints and frames of the current state, where subscribed; stamp in ns."""
        if not self._bodies:
            return
        if self._tracked.get_subscription_count():
            self._tracked.publish(IdsList(header=to_header(stamp, self._frame),
                                          ids=[each.body.id for each in self._bodies]))
        angles = rates = None
        for each in self._bodies:
            if each.joints.get_subscription_count():
                if angles is None:
                    angles, rates = simulation.joint_angles, simulation.joint_rates
                each.joints.publish(each.template.serialize(stamp, angles[each.body.angles],
                                                            rates[each.body.angles]))
        if self._tf is not None and self._tf.get_subscription_count():
            found = [each.body for each in self._bodies]
            edges = [(self._frame, body.frame_name) for body in found]
            self._tf.publish(to_tf(edges, stamp, body_poses(found, simulation)))

    def _set_common(self, some: bool, with_tf: bool) -> None:
        """Create or destroy the publishers of all persons: ids and, with_tf, frames."""
        for name, wanted, kind, topic, qos in (
                ('_tracked', some, IdsList, '/humans/bodies/tracked', LATCHED),
                ('_tf', some and with_tf, TFMessage, '/tf', DEPTH)):
            publisher = getattr(self, name)
            if wanted and publisher is None:
                setattr(self, name, self._node.create_publisher(kind, topic, qos))
            elif publisher is not None and not wanted:
                self._node.destroy_publisher(publisher)
                setattr(self, name, None)

    def _created(self, body: Body) -> BodyPublishers:
        """Create the publishers of a body and publish its URDF."""
        create, topic = self._node.create_publisher, f'/humans/bodies/{body.id}'
        count = len(body.joint_names)
        made = BodyPublishers(
            body, create(JointState, f'{topic}/joint_states', 10),
            create(String, f'{topic}/urdf', LATCHED),
            SerializedTemplate.trace(partial(to_joint_state, body.frame_name, body.joint_names),
                                     (count,), (count,)))
        made.urdf.publish(String(data=body.urdf))
        return made


def body_poses(found: list[Body], simulation: Simulation) -> np.ndarray:
    """Poses (n, 7) of the frames body_<id>, world frame."""
    frames = [simulation.state.poses(body.root).compose(body.frame) for body in found]
    return np.array([(*frame.position, *frame.orientation) for frame in frames])
