"""Subscriptions that move bodies with `follow`, and robots: Odometry, a Twist or a JointState
becomes drive_body().
"""
from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import partial

from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.subscription import Subscription
from sensor_msgs.msg import JointState

from ....model import errors, rotation
from ....model.drive import MAX_SPEED
from ....model.vectors import unit_vector
from ....physics.simulation import Simulation
from ...parameters.node_settings import NodeSettings
from ..input_counts import InputCounts
from ..joint_values import joint_values
from ..subscriptions import limited
from .body_frames import BodyFrames

JOINTS = 'joint_states'


class BodySubscriptions:
    """Subscriptions to ~/bodies/<name>/odom and ~/bodies/<name>/cmd_vel, for each driven body and
    robot, to ~/bodies/<name>/joint_states, for each robot, and to /tf, where bodies follow frames.

    A pose is that of the body's frame in the world frame, whatever the message calls its frames: a
    robot's odometry has names of its own. Twists are along the body's axes, as nav_msgs and REP 103
    have them. Those of a robot are its root link's. ``after`` is called when a body has been told
    how to move.
    """

    def __init__(self, node: Node, counts: InputCounts, after: Callable[[], None]) -> None:
        self._node, self._counts, self._after = node, counts, after
        self._subscriptions: list[Subscription] = []
        self._names: tuple[tuple[str, ...], tuple[str, ...]] = (), ()
        """Of all that is driven, and of robots."""
        self._frames = BodyFrames(node, self._drive_by_frame, counts.refuse)
        self.simulation: Simulation

    def set_simulation(self, simulation: Simulation, settings: NodeSettings) -> None:
        """Move the bodies of this simulation, and subscribe for those of its scene."""
        self.simulation, scene = simulation, simulation.scene
        self.configure(settings)
        names = scene.driven_names, tuple(robot.name for robot in scene.robots)
        if names == self._names:
            return
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        self._names = names
        driven, robots = names
        self._subscriptions = [
            self._node.create_subscription(kind, f'{body_topic(name)}/{end}',
                                           partial(callback, name), 10)
            for kind, end, callback, own in ((Odometry, 'odom', self.on_odometry, driven),
                                             (Twist, 'cmd_vel', self.on_cmd_vel, driven),
                                             (JointState, JOINTS, self.on_joint_states, robots))
            for name in own]

    def configure(self, settings: NodeSettings) -> None:
        """Follow the frames that the settings name."""
        self._frames.configure(settings.body_frames, self.simulation.scene, settings.frame_id)

    def on_odometry(self, name: str, message: Odometry) -> None:
        """Move a body on from a pose; a message that is wrong is refused and counted."""
        pose, source = message.pose.pose, f'{body_topic(name)}/odom'
        q, p = pose.orientation, pose.position
        try:
            orientation = unit_vector('pose.orientation', (q.x, q.y, q.z, q.w),
                                      'a quaternion x, y, z, w, not zero', 4)
            self._drive(source, name, (p.x, p.y, p.z, *orientation), orientation,
                        message.twist.twist)
        except errors.ModelError as error:
            self._counts.refuse(source, error)

    def on_cmd_vel(self, name: str, message: Twist) -> None:
        """Move a body on from where it is; a message that is wrong is refused and counted."""
        source = f'{body_topic(name)}/cmd_vel'
        try:
            self._drive(source, name, None, self.simulation.body_pose(name)[3:], message)
        except errors.ModelError as error:
            self._counts.refuse(source, error)

    def on_joint_states(self, name: str, message: JointState) -> None:
        """Move joints of a robot on; a message that is wrong is refused and counted."""
        try:
            angles, rates = joint_values(message)
            self.simulation.drive_body(name, joint_angles=angles, rates=rates)
        except errors.ModelError as error:
            self._counts.refuse(f'{body_topic(name)}/{JOINTS}', error)
        else:
            self._after()

    def _drive_by_frame(self, name: str, pose: Sequence[float], twist: Sequence[float]) -> None:
        self.simulation.drive_body(name, pose, twist)
        self._after()

    def _drive(self, source: str, name: str, pose: Sequence[float] | None,
               orientation: Sequence[float], twist: Twist) -> None:
        """Move a body; ``orientation``: of the axes that the twist is along."""
        parts = [rotation.rotate(orientation, limited(
            self._counts, source, f'twist.{key}', getattr(twist, key), MAX_SPEED, 'the limit'))
            for key in ('linear', 'angular')]
        self.simulation.drive_body(name, pose, [*parts[0].tolist(), *parts[1].tolist()])
        self._after()


def body_topic(name: str) -> str:
    """Where a body's topics are: its name with what no topic may have as _."""
    return '~/bodies/' + re.sub(r'^(?=\d)', '_', re.sub(r'\W', '_', name, flags=re.ASCII))
