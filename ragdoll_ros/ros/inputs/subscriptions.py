"""Subscriptions that push: wrenches become a Push, a Twist or TwistStamped becomes a Drive.

Input that is not finite or names an unknown bone is refused; a vector that is too long is clamped
and keeps its direction. Both are counted.
"""
from __future__ import annotations

from typing import Protocol

from geometry_msgs.msg import Twist, TwistStamped, Vector3, Wrench, WrenchStamped
from rclpy.node import Node
from rclpy.subscription import Subscription
from sensor_msgs.msg import MultiDOFJointState

from ...model import errors
from ...model.drive import MAX_FORCE, MAX_SPEED, MAX_TORQUE, Drive
from ...model.push import Push
from ...model.ragdoll import WORLD
from ...model.scene import Scene
from ...model.vectors import Vector, clamp_norm
from ..parameters.node_settings import NodeSettings
from .cmd_vel import CmdVelSubscription
from .input_counts import InputCounts
from .wrench_at import TOPIC as WRENCH_AT
from .wrench_at import pushes_at

TORQUE_ARM = 0.1
"""m: the largest torque is max_force times this."""

MAX_TORQUE_NAME = f'{TORQUE_ARM:g} m times max_force'


class PushTarget(Protocol):
    """What is pushed: a simulation, or a stand-in in a process that only listens."""

    scene: Scene

    def push(self, push: Push | Drive, channel: str) -> None:
        """Apply a push or drive; it replaces the last one of its channel."""

    def release(self, channel: str) -> None:
        """End the push of a channel."""


class PushSubscriptions:
    """Subscriptions to ~/force, cmd_vel, ~/push and ~/wrench_at. Each of the first two is a channel
    of pushes; ~/push has one for each frame, ~/wrench_at one for each bone.

    ``name``: of the pushed node, if another node listens as well. All are reliable: a best-effort
    subscription lost 3 of 40 messages that were sent right after matching.
    """

    def __init__(self, node: Node, counts: InputCounts, name: str = '~') -> None:
        self._counts = counts
        self.simulation: PushTarget
        self._settings: NodeSettings
        self.cmd_vel = CmdVelSubscription(node, self.on_cmd_vel, self.on_stamped_cmd_vel)
        self._wrenches = [
            node.create_subscription(Wrench, f'{name}/force', self.on_force, 10),
            node.create_subscription(WrenchStamped, f'{name}/push', self.on_push, 10),
            node.create_subscription(MultiDOFJointState, f'{name}/wrench_at', self.on_wrench_at,
                                     10)]

    @property
    def settings(self) -> NodeSettings:
        """Values of the node's parameters. Setting them subscribes to cmd_vel with its type."""
        return self._settings

    @settings.setter
    def settings(self, settings: NodeSettings) -> None:
        self._settings = settings
        self.cmd_vel.subscribe(settings.stamped_cmd_vel)

    @property
    def subscriptions(self) -> list[Subscription]:
        """All present subscriptions."""
        return [*self._wrenches, *filter(None, [self.cmd_vel.subscription])]

    def on_force(self, message: Wrench) -> None:
        """Push the pushed bone in the world frame; a zero wrench ends the push."""
        self._push('~/force', 'force', self.settings.pushed_bone, message)

    def on_cmd_vel(self, message: Twist) -> None:
        """Drive the pushed bone towards a velocity in the world frame.

        A part (linear or angular) that is zero is not driven: a doll is passive, and a command to
        turn does not hold it in the air. A zero twist ends the drive.
        """
        settings = self.settings
        with self._counts.refusing('cmd_vel'):
            linear, angular = (self._limited('cmd_vel', name, vector, MAX_SPEED, 'the limit')
                               for name, vector in (('linear', message.linear),
                                                    ('angular', message.angular)))
            if any(linear) or any(angular):
                self.simulation.push(Drive(
                    settings.pushed_bone, linear if any(linear) else None,
                    angular if any(angular) else None,
                    settings.force_per_speed, settings.torque_per_speed,
                    min(MAX_FORCE, settings.max_force),
                    min(MAX_TORQUE, settings.max_force * TORQUE_ARM),
                    duration=settings.cmd_vel_timeout), 'cmd_vel')
            else:
                self.simulation.release('cmd_vel')

    def on_stamped_cmd_vel(self, message: TwistStamped) -> None:
        """As on_cmd_vel. Without a frame, as from many keyboard programs, a message is in the world
        frame; in any other frame it is refused.
        """
        frame = message.header.frame_id
        if frame in ('', WORLD, self.settings.frame_id):
            self.on_cmd_vel(message.twist)
        else:
            self._counts.refuse('cmd_vel', errors.WrongForm(
                'header.frame_id', frame,
                f'{self.settings.frame_id} or none: velocities are along the world axes'))

    def on_push(self, message: WrenchStamped) -> None:
        """Push the pushed bone in the world frame, or the bone of frame_id in its own frame."""
        settings, frame = self.settings, message.header.frame_id
        local = frame not in (WORLD, settings.frame_id)
        with self._counts.refusing('~/push'):
            names = self.simulation.scene.bone_names
            if local and frame not in names:
                raise errors.UnknownBone('header.frame_id', frame,
                                         f'one of {", ".join((WORLD, *names))}')
            bone = frame if local else settings.pushed_bone
            self._push('~/push', f'push {frame if local else WORLD}', bone, message.wrench, local)

    def on_wrench_at(self, message: MultiDOFJointState) -> None:
        """Push bones at points of theirs. If a part of the message is wrong, nothing is pushed."""
        with self._counts.refusing(WRENCH_AT):
            for channel, push in pushes_at(message, self.simulation.scene, self.settings.frame_id,
                                           self.settings.push_timeout, self._limited_at):
                self._push_or_release(push, channel)

    def _push(self, source: str, channel: str, bone: str, wrench: Wrench,
              local: bool = False) -> None:
        """Apply a wrench for push_timeout; ``local``: in the bone's own frame."""
        limit = self.settings.max_force
        with self._counts.refusing(source):
            force = self._limited(source, 'force', wrench.force, limit, 'max_force')
            torque = self._limited(source, 'torque', wrench.torque, limit * TORQUE_ARM,
                                   MAX_TORQUE_NAME)
            self._push_or_release(Push(bone, force, torque, local=local,
                                       duration=self.settings.push_timeout), channel)

    def _push_or_release(self, push: Push, channel: str) -> None:
        """Apply a push; one without force and torque ends the last one of its channel."""
        if any(push.force) or any(push.torque):
            self.simulation.push(push, channel)
        else:
            self.simulation.release(channel)

    def _limited_at(self, name: str, vector: Vector3) -> Vector:
        """Limit a force or torque of ~/wrench_at. The end of ``name`` tells which it is."""
        limit, limit_name = self.settings.max_force, 'max_force'
        if name.endswith('torque'):
            limit, limit_name = limit * TORQUE_ARM, MAX_TORQUE_NAME
        return self._limited(WRENCH_AT, name, vector, limit, limit_name)

    def _limited(self, source: str, name: str, vector: Vector3, limit: float,
                 limit_name: str) -> Vector:
        return limited(self._counts, source, name, vector, limit, limit_name)


def limited(counts: InputCounts, source: str, name: str, vector: Vector3, limit: float,
            limit_name: str) -> Vector:
    """Return the vector, shortened to ``limit`` if it is longer; this is counted as clamped. Raises
    NotFinite.
    """
    values = (vector.x, vector.y, vector.z)
    errors.check_finite(name, values)
    result, length = clamp_norm(values, limit)
    if length > limit:
        counts.clamp(source, f'{name} of {length:g} to {limit_name}, {limit:g}')
    return result
