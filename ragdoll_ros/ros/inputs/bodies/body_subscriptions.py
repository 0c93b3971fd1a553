"""Subscriptions that move bodies with `follow`, and robots: Odometry, a Twist or a JointState
becomes drive_body(), or set_pose_target() where a robot is a doll on a fixed root.
"""
from __future__ import annotations

import itertools
import math
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
from ....model.scene import Scene
from ....model.vectors import unit_vector
from ....physics.actions.body_motion import TIMEOUT
from ....physics.simulation import Simulation
from ...messages.convert import from_time
from ...parameters.node_settings import NodeSettings
from ..input_counts import InputCounts
from ..joint_values import joint_values
from ..subscriptions import limited
from .body_frames import BodyFrames
from .message_times import MessageTimes, carried_on

JOINTS = 'joint_states'


class BodySubscriptions:
    """Subscriptions to ~/bodies/<name>/odom and ~/bodies/<name>/cmd_vel for each driven body and
    robot; to ~/bodies/<name>/joint_states for each robot and each doll with motors on a fixed root;
    and to /tf where bodies follow frames.

    A pose is that of the body's frame in the world frame, whatever the message calls its frames: a
    robot's odometry has frame names of its own. Twists are along the body's axes, as nav_msgs and
    REP 103 define them. Pose and twist of a robot are those of its root link. Values of a message
    with a stamp are extrapolated to the present, see message_times.py. ``after`` is called when a
    body has been told how to move; ``now()`` is the stamp of the present state, ns.
    """

    def __init__(self, node: Node, counts: InputCounts, after: Callable[[], None],
                 now: Callable[[], int]) -> None:
        self._node, self._counts, self._after = node, counts, after
        self._times = MessageTimes(now)
        self._unknown: set[tuple[str, str]] = set()
        """Robots and joints that were named and do not exist."""
        self._subscriptions: dict[str, list[Subscription]] = {}
        """By the name of the body or robot."""
        self._names: tuple[tuple[str, ...], tuple[str, ...]] = (), ()
        """Of all that is driven, and of what has joints."""
        self._aimed: dict[str, int] = {}
        """Simulated times, ns, at which dolls got targets last, by name."""
        self._frames = BodyFrames(node, self._drive_by_frame, counts.refuse)
        self.simulation: Simulation

    def set_simulation(self, simulation: Simulation, settings: NodeSettings) -> None:
        """Move the bodies of this simulation, and subscribe for those of its scene."""
        self.simulation, scene = simulation, simulation.scene
        self.configure(settings)
        names = scene.driven_names, (*(robot.name for robot in scene.robots), *(
            placement.name for placement in scene.dolls
            if placement.fixed_root and placement.motors))
        if names == self._names:
            return
        for subscription in itertools.chain(*self._subscriptions.values()):
            self._node.destroy_subscription(subscription)
        self._names = names
        self._aimed.clear()
        self._subscriptions = {name: [
            self._node.create_subscription(kind, f'{body_topic(name)}/{end}',
                                           partial(callback, name), 10)
            for kind, end, callback, own in ((JointState, JOINTS, self.on_joint_states, names[1]),
                                             (Odometry, 'odom', self.on_odometry, names[0]),
                                             (Twist, 'cmd_vel', self.on_cmd_vel, names[0]))
            if name in own] for name in dict.fromkeys((*names[0], *names[1]))}

    @property
    def silent(self) -> tuple[str, ...]:
        """What nothing moves: stale bodies, and dolls whose joint states have ended."""
        now = self.simulation.time
        return (*self.simulation.stale_bodies,
                *(name for name, time in self._aimed.items() if now - time > TIMEOUT))

    @property
    def moved_by(self) -> dict[str, list[str]]:
        """Topics, as they are remapped, by the name of what they move."""
        return {name: self.topics(name) for name in self._subscriptions}

    def topics(self, name: str) -> list[str]:
        """Topics that move a body or robot, as they are remapped."""
        return [subscription.topic_name for subscription in self._subscriptions[name]]

    def configure(self, settings: NodeSettings) -> None:
        """Follow the frames that the settings name."""
        self._frames.configure(settings.body_frames, self.simulation.scene, settings.frame_id)

    def on_odometry(self, name: str, message: Odometry) -> None:
        """Drive a body from the pose of the message, with its twist; a message that is wrong is
        refused and counted.
        """
        pose, source = message.pose.pose, f'{body_topic(name)}/odom'
        q, p = pose.orientation, pose.position
        with self._counts.refusing(source):
            orientation = unit_vector('pose.orientation', (q.x, q.y, q.z, q.w),
                                      'a quaternion x, y, z, w, not zero', 4)
            self._drive(source, name, (p.x, p.y, p.z, *orientation), orientation,
                        message.twist.twist, self._times.lead(from_time(message.header.stamp)))

    def on_cmd_vel(self, name: str, message: Twist) -> None:
        """Drive a body from its present pose, with the twist of the message; a message that is
        wrong is refused and counted.
        """
        source = f'{body_topic(name)}/cmd_vel'
        with self._counts.refusing(source):
            self._drive(source, name, None, self.simulation.body_pose(name)[3:], message, 0.0)

    def on_joint_states(self, name: str, message: JointState) -> None:
        """Set angles and rates of a robot's joints, or targets of a doll's motors; a message that
        is wrong is refused and counted. If at least one name is the robot's, other names, as of a
        gripper or a second arm, are left out and logged.
        """
        with self._counts.refusing(f'{body_topic(name)}/{JOINTS}'):
            angles, rates = joint_values(message)
            known = turning_joints(self.simulation.scene, name)
            if known.keys() & set(message.name):
                self._note_unknown(name, [each for each in message.name if each not in known])
                angles, rates = ({joint: value for joint, value in values.items() if joint in known}
                                 for values in (angles, rates))
            stamp = from_time(message.header.stamp)
            rates = rates or self._times.rates(name, stamp, angles, known)
            lead = self._times.lead(stamp)
            angles = {joint: angle + lead * rates.get(joint, 0.0)
                      for joint, angle in angles.items()}
            if any(robot.name == name for robot in self.simulation.scene.robots):
                self.simulation.drive_body(name, rates=rates, joint_angles=angles)
            else:
                self._aim(name, angles, rates, known)
            self._after()

    def _aim(self, name: str, angles: dict[str, float], rates: dict[str, float],
             known: dict[str, bool]) -> None:
        """Set targets of a doll's motors; a joint without limits turns the shorter way. ``known``:
        see turning_joints(). Raises UnknownJoint if none of the names is the doll's.
        """
        named = {**angles, **rates}
        if named and not named.keys() & known.keys():
            raise errors.UnknownJoint('name', next(iter(named)),
                                      errors.one_of(list(known), next(iter(named))))
        scene = self.simulation.scene
        placement, = (each for each in scene.dolls if each.name == name)
        present = dict(zip(scene.angle_names, self.simulation.joint_angles.tolist(), strict=True))
        own = {joint: scene.qualified(placement, joint) for joint in {*angles, *rates}}
        for joint in angles:
            if known.get(joint):
                angles[joint] += math.tau * round((present[own[joint]] - angles[joint]) / math.tau)
        self.simulation.set_pose_target(*({own[joint]: value for joint, value in values.items()}
                                          for values in (angles, rates)))
        self._aimed[name] = self.simulation.time

    def _note_unknown(self, name: str, joints: list[str]) -> None:
        """Log, once for each, joints that the robot of this name does not have."""
        new = [joint for joint in joints if (name, joint) not in self._unknown]
        if new:
            self._unknown |= {(name, joint) for joint in new}
            self._node.get_logger().warning(
                f'{body_topic(name)}/{JOINTS}: {name} has no joint {", ".join(new)}: left out')

    def _drive_by_frame(self, name: str, pose: Sequence[float], twist: Sequence[float],
                        stamp: int) -> None:
        self.simulation.drive_body(
            name, carried_on(pose, twist, self._times.lead(stamp)), twist)
        self._after()

    def _drive(self, source: str, name: str, pose: Sequence[float] | None,
               orientation: Sequence[float], twist: Twist, lead: float) -> None:
        """Move a body. ``pose``: (7,), None: from where it is; ``orientation``: of the axes along
        which the twist is given; ``lead``: time since the pose, s.
        """
        parts = [rotation.rotate(orientation, limited(
            self._counts, source, f'twist.{key}', getattr(twist, key), MAX_SPEED, 'the limit'))
            for key in ('linear', 'angular')]
        moves = [*parts[0].tolist(), *parts[1].tolist()]
        self.simulation.drive_body(name, pose and carried_on(pose, moves, lead), moves)
        self._after()


def turning_joints(scene: Scene, name: str) -> dict[str, bool]:
    """Return whether each joint of a robot, or angle of a doll, turns without limits, by name."""
    found = {joint.name: joint.kind == 'continuous' for robot in scene.robots if robot.name == name
             for joint in robot.joints if joint.kind != 'fixed'}
    return found | {angle: limits is None for placement in scene.dolls if placement.name == name
                    for joint in placement.doll.joints for angle, limits in zip(
                        joint.angle_names, joint.angle_limits, strict=True)}


def body_topic(name: str) -> str:
    """Return the prefix of a body's topics: its name with _ for each character that no topic may
    have, and before a leading digit.
    """
    return '~/bodies/' + re.sub(r'^(?=\d)', '_', re.sub(r'\W', '_', name, flags=re.ASCII))
