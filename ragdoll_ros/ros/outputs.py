"""Publishers of measures, poses, state, joints, contacts, swings, markers, tf, /clock, URDF."""
from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseArray
from rclpy.node import Node
from rclpy.publisher import Publisher
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState, MultiDOFJointState
from std_msgs.msg import String
from visualization_msgs.msg import Marker, MarkerArray

from ..files.urdf import scene_to_urdf, urdf_tree
from ..model.per_doll import PerDoll
from ..model.scene import Scene
from ..model.state import State
from .humans.body import Body
from .humans.publishers import Humans
from .latched_topic import (
    LATCHED,
    LATCHED_HISTORY,
    LatchedTopic,
    has_subscribers,
    overridable_publisher,
)
from .messages.contact_wrenches import to_contact_wrenches
from .messages.convert import contact_poses, count_masses, poses_of, to_time, twists_of
from .messages.measures import TickMeasures, checksum, serialize_measures
from .messages.serialized import serialize_pose_array
from .messages.templates import SceneTemplates
from .messages.tf import TfPublisher, TfTemplate

if TYPE_CHECKING:  # else the page, which imports this file, would load an engine
    from ..physics.simulation import Simulation

MARKER_PERIOD = 33_000_000
"""ns of the steady clock between two MarkerArrays: 30 Hz, enough for a screen."""


class PreparedOutputs(NamedTuple):
    """What is published once for a scene, and the templates of the messages of its states."""

    description: str
    """Of robot_description."""
    checksums: tuple[str, str]
    """Of that, and of the text on ~/scene."""
    templates: SceneTemplates
    tf: TfTemplate | None
    humans: list[Body]


class Outputs:
    """The publishers of a node, and the templates of their messages."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._poses = LatchedTopic(node, PoseArray, '~/poses')
        self._state = overridable_publisher(node, MultiDOFJointState, '~/state', 10)
        self._joints = overridable_publisher(node, JointState, 'joint_states', 10)
        self._joints_move = ''
        """What joint_states would move, as they are on the topic that does."""
        self._measures = LatchedTopic(node, DiagnosticArray, '~/measures')
        self._name = node.get_fully_qualified_name()
        self._run: tuple[Simulation | None, int, int] = (None, 0, 0)
        """The simulation that was published last, its reset_count, and the number of that run."""
        self._energies: tuple[State | None, float, float, float] = (None, 0.0, 0.0, 0.0)
        """A state of that run, its energy excess and the work of pushes and of grabs, J."""
        self._swings: LatchedTopic | None = None
        self._contacts = overridable_publisher(node, PoseArray, '~/contacts', 10)
        self._wrenches = overridable_publisher(node, MultiDOFJointState, '~/contact_wrenches', 10)
        self._markers = LatchedTopic(node, MarkerArray, '~/markers', LATCHED_HISTORY)
        self._urdf_trees = PerDoll(urdf_tree)
        self._templates: SceneTemplates | None = None
        self._description = node.create_publisher(String, 'robot_description', LATCHED)
        self._tf = TfPublisher(node)
        self.humans = Humans(node)
        self._clock: Publisher | None = None

    def prepare(self, scene: Scene, frame: str, publish_tf: str,
                text: str = '') -> PreparedOutputs:
        """Make what set_scene() takes. ``text``: that on ~/scene. This may run beside the ticks."""
        self._urdf_trees.keep(placement.doll for placement in scene.dolls)
        description = scene_to_urdf(scene, frame, self._urdf_trees)
        templates = SceneTemplates(scene, frame)
        if self._templates is not None:
            templates.make_as(self._templates)
        checksums = checksum(description), text and checksum(text)
        return PreparedOutputs(description, checksums, templates,
                               self._tf.prepare(scene, frame, publish_tf),
                               self.humans.prepare(scene))

    def set_scene(self, scene: Scene, frame: str, publish_tf: str,
                  prepared: PreparedOutputs | None = None) -> None:
        """Publish a scene's URDF, and its states from now on; ``frame``: the world frame."""
        prepared = prepared or self.prepare(scene, frame, publish_tf)
        self._templates, self._frame = prepared.templates, frame
        self._set_swings_publisher(count_masses(scene) > 0)
        self._next_markers = 0
        self._pending = [publish for topic, publish in self._latched_topics if topic is not None]
        """What has not published the last tick, for want of subscribers."""
        self._tf.set_scene(scene, frame, publish_tf, prepared.tf)
        self.humans.set_scene(prepared.humans, frame, publish_tf)
        self._checksums = prepared.checksums
        self._description.publish(String(data=prepared.description))

    def keep_joints_from(self, moved_by: Mapping[str, Sequence[str]]) -> None:
        """Publish no joint_states on a topic that moves joints: they would follow themselves.

        ``moved_by``: topics by the names of what they move.
        """
        topic, before = self._joints.topic_name, self._joints_move
        self._joints_move = ' and '.join(
            name for name, topics in moved_by.items() if topic in topics)
        if self._joints_move not in ('', before):
            self._node.get_logger().warning(
                f'joint_states are not published, as {topic} moves {self._joints_move}: give them '
                f'another name, as by -r joint_states:={self._node.get_name()}/joint_states')

    def unload(self) -> None:
        """End what is shown: late subscribers get no state and an empty URDF, and all markers are
        deleted.
        """
        self._pending = []
        for topic in filter(None, (self._measures, self._swings, self._poses)):
            topic.forget()
        self._markers.publish(MarkerArray(markers=[Marker(action=Marker.DELETEALL)]))
        self.humans.set_scene([], self._frame, 'none')
        self._description.publish(String())

    @property
    def has_subscribers(self) -> bool:
        """Whether somebody receives messages of each tick: a topic other than ~/markers has a
        subscriber, or /clock is published.
        """
        return (self._clock is not None
                or any(topic is not None and topic.has_subscribers
                       for topic in (self._measures, self._poses, self._swings))
                or self._tf.has_subscribers or self.humans.has_subscribers
                or self._joints_wanted or any(
                    map(has_subscribers, (self._state, self._contacts, self._wrenches))))

    @property
    def _joints_wanted(self) -> bool:
        return not self._joints_move and has_subscribers(self._joints)

    def publish(self, simulation: Simulation, stamp: int, now: int, paused: bool = False) -> None:
        """Publish the simulation's state with ``stamp``, ns, on topics with subscribers. Markers
        come at most every MARKER_PERIOD by ``now``, ns of the steady clock. Poses come last, so
        that whoever has them has the rest of the tick, too.

        ``paused``: publish measures, swings, poses and markers at once and also without a
        subscriber, for late ones.
        """
        self.publish_clock(stamp)
        self._tf.publish(simulation, stamp)
        self.humans.publish(simulation, stamp)
        templates = self._templates
        if has_subscribers(self._state):
            state = simulation.state
            self._state.publish(templates.state.serialize(stamp, poses_of(state), twists_of(state)))
        if self._joints_wanted:
            self._joints.publish(templates.joints.serialize(
                stamp, simulation.joint_angles, simulation.joint_rates))
        if has_subscribers(self._contacts):
            self._contacts.publish(serialize_pose_array(self._frame, stamp,
                                                        contact_poses(simulation.contacts)))
        if has_subscribers(self._wrenches):
            self._wrenches.publish(to_contact_wrenches(self._frame, simulation.scene, stamp,
                                                       simulation.contacts))
        if not (paused or self._markers.has_subscribers):
            self._markers.forget()
        elif paused or now >= self._next_markers:
            self._next_markers = now + MARKER_PERIOD
            self._publish_markers(simulation, stamp)
        self._pending = []
        for topic, publish in self._latched_topics:
            if topic is not None and (paused or topic.has_subscribers):
                publish(simulation, stamp)
            elif topic is not None:
                topic.forget()
                self._pending.append(publish)

    @property
    def _latched_topics(self) -> tuple[tuple[
            LatchedTopic | None, Callable[[Simulation, int], None]], ...]:
        """Topics with the last ticks for late subscribers, each with its method that publishes;
        None for a topic that does not exist. Poses last.
        """
        return ((self._measures, self._publish_measures), (self._swings, self._publish_swings),
                (self._poses, self._publish_poses))

    def publish_on_pause(self, simulation: Simulation, stamp: int) -> None:
        """On pause, publish to the latched topics what they lack of the last tick, and the markers,
        for late subscribers.
        """
        for publish in self._pending:
            publish(simulation, stamp)
        self._pending = []
        self._publish_markers(simulation, stamp)

    def _publish_measures(self, simulation: Simulation, stamp: int) -> None:
        """Publish time, run and energy of the state with this stamp."""
        last, reset_count, run = self._run
        if last is not simulation or reset_count != simulation.reset_count:
            run = time.time_ns()
            self._run = simulation, simulation.reset_count, run
            self._energies = (None, 0.0, 0.0, 0.0)
        state = simulation.state
        if state is not self._energies[0]:  # dolls that sleep keep theirs
            self._energies = state, simulation.energy_excess, *simulation.work
        self._measures.publish(serialize_measures(self._name, stamp, TickMeasures(
            simulation.time, run, *self._checksums, *self._energies[1:])))

    def _publish_swings(self, simulation: Simulation, stamp: int) -> None:
        self._swings.publish(self._templates.swings.serialize(stamp, poses_of(simulation.swings)))

    def _publish_poses(self, simulation: Simulation, stamp: int) -> None:
        """Publish the PoseArray of all bones on ~/poses; SceneTemplates.poses makes it."""
        self._poses.publish(self._templates.poses.serialize(stamp, poses_of(simulation.state)))

    def _publish_markers(self, simulation: Simulation, stamp: int) -> None:
        self._markers.publish(self._templates.markers.serialize(
            stamp, simulation.state, simulation.pushes, simulation.swings))

    def republish(self, simulation: Simulation, stamp: int) -> None:
        """While paused, repeat /clock, and /tf for new subscribers."""
        self.publish_clock(stamp)
        self._tf.republish(simulation, stamp)

    def publish_clock(self, stamp: int) -> None:
        """Publish simulated time, ns, if this node publishes /clock."""
        if self._clock is not None:
            self._clock.publish(Clock(clock=to_time(stamp)))

    def _set_swings_publisher(self, enabled: bool) -> None:
        """Create or destroy the publisher of ~/swings: a scene without swings has no such topic."""
        if enabled and self._swings is None:
            self._swings = LatchedTopic(self._node, PoseArray, '~/swings')
        elif not enabled and self._swings is not None:
            self._swings.destroy()
            self._swings = None

    def set_clock_publisher(self, enabled: bool) -> None:
        """Create or destroy the publisher of /clock."""
        if enabled and self._clock is None:
            self._clock = self._node.create_publisher(Clock, '/clock', LATCHED_HISTORY)
        elif not enabled and self._clock is not None:
            self._node.destroy_publisher(self._clock)
            self._clock = None
