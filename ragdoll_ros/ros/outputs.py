"""All that is published of the dolls, while somebody listens or the time stands."""
from __future__ import annotations

from typing import TYPE_CHECKING

from geometry_msgs.msg import PoseArray
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState, MultiDOFJointState
from std_msgs.msg import String
from visualization_msgs.msg import MarkerArray

from ..files.urdf import scene_to_urdf
from ..model.scene import Scene
from .messages.convert import contact_poses, count_masses, poses_of, to_time, twists_of
from .messages.serialized import packed_poses
from .messages.templates import Layouts
from .messages.tf import Transforms

if TYPE_CHECKING:  # else the page, which reads this file, would load an engine
    from ..physics.simulation import Simulation

MARKER_PERIOD = 33_000_000
"""ns of the steady clock between two MarkerArrays: as often as a screen can use."""

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)

KEPT = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""For what stands still with the time: who comes then can ask for the last ones."""


class Outputs:
    """Publishers, and the messages that go out through them."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._poses = node.create_publisher(PoseArray, '~/poses', KEPT)
        self._state = node.create_publisher(MultiDOFJointState, '~/state', 10)
        self._joints = node.create_publisher(JointState, 'joint_states', 10)
        self._swings: Publisher | None = None
        self._contacts = node.create_publisher(PoseArray, '~/contacts', 10)
        self._markers = node.create_publisher(MarkerArray, '~/markers', KEPT)
        self._description = node.create_publisher(String, 'robot_description', LATCHED)
        self._transforms = Transforms(node)
        self._clock: Publisher | None = None

    def describe(self, scene: Scene, frame: str, tree: str) -> None:
        """Make ready for a scene, and publish its URDF; ``tree`` is what of it is on /tf."""
        self._layouts, self._frame = Layouts(scene, frame), frame
        self._offer_swings(count_masses(scene) > 0)
        self._next_markers = 0
        self._untold = False
        self._transforms.describe(scene, frame, tree)
        self._description.publish(String(data=scene_to_urdf(scene, frame)))

    @property
    def heard(self) -> bool:
        """Whether somebody listens to what goes out with each tick."""
        topics = self._poses, self._state, self._joints, self._contacts, self._swings
        return self._clock is not None or self._transforms.heard or any(
            topic is not None and topic.get_subscription_count() for topic in topics)

    def publish(self, simulation: Simulation, stamp: int, now: int, still: bool = False) -> None:
        """Publish where the simulation is; ``stamp`` and the steady clock's ``now`` in ns.

        ``still``: nothing may follow, so that poses can not stay away, nor markers wait.
        """
        self.publish_clock(stamp)
        self._transforms.publish(simulation, stamp)
        if still or self._poses.get_subscription_count():
            self._publish_poses(simulation, stamp)
        else:
            self._untold = True
        if self._state.get_subscription_count():
            state = simulation.state
            self._state.publish(self._layouts.state.message(stamp, poses_of(state),
                                                            twists_of(state)))
        if self._joints.get_subscription_count():
            self._joints.publish(self._layouts.joints.message(
                stamp, simulation.joint_angles, simulation.joint_rates))
        if self._swings is not None and self._swings.get_subscription_count():
            self._swings.publish(self._layouts.swings.message(stamp, poses_of(simulation.swings)))
        if self._contacts.get_subscription_count():
            self._contacts.publish(packed_poses(self._frame, stamp,
                                                contact_poses(simulation.contacts)))
        if still or (now >= self._next_markers and self._markers.get_subscription_count()):
            self._next_markers = now + MARKER_PERIOD
            self._publish_markers(simulation, stamp)

    def stand(self, simulation: Simulation, stamp: int) -> None:
        """Publish what the last tick has not, heard or not, as the time stands from now on.

        Who comes then asks for the past.
        """
        if self._untold:
            self._publish_poses(simulation, stamp)
        self._publish_markers(simulation, stamp)

    def _publish_poses(self, simulation: Simulation, stamp: int) -> None:
        self._untold = False
        self._poses.publish(self._layouts.poses.message(stamp, poses_of(simulation.state)))

    def _publish_markers(self, simulation: Simulation, stamp: int) -> None:
        self._markers.publish(self._layouts.markers.message(
            stamp, simulation.state, simulation.pushes, simulation.swings))

    def repeat(self, simulation: Simulation, stamp: int) -> None:
        """Publish the standing time, and for who has come since, the standing frames."""
        self.publish_clock(stamp)
        self._transforms.repeat(simulation, stamp)

    def publish_clock(self, stamp: int) -> None:
        """Publish the time, ns, if this node is the clock."""
        if self._clock is not None:
            self._clock.publish(Clock(clock=to_time(stamp)))

    def _offer_swings(self, wanted: bool) -> None:
        """Begin or end to publish swings: a scene without any has no such topic."""
        if wanted and self._swings is None:
            self._swings = self._node.create_publisher(PoseArray, '~/swings', 10)
        elif not wanted and self._swings is not None:
            self._node.destroy_publisher(self._swings)
            self._swings = None

    def be_clock(self, wanted: bool) -> None:
        """Begin or end to publish /clock."""
        if wanted and self._clock is None:
            self._clock = self._node.create_publisher(Clock, '/clock', KEPT)
        elif not wanted and self._clock is not None:
            self._node.destroy_publisher(self._clock)
            self._clock = None
