"""Messages that push: from Wrench and WrenchStamped to Push, from Twist to Drive.

What is not finite or names no bone is refused, what is too strong or fast is clamped to its
direction; both are counted, and the doll goes on.
"""
from __future__ import annotations

from typing import Protocol

from geometry_msgs.msg import Twist, Vector3, Wrench, WrenchStamped
from rclpy.node import Node

from ..model import errors
from ..model.drive import MAX_FORCE, MAX_SPEED, MAX_TORQUE, Drive
from ..model.push import Push
from ..model.ragdoll import WORLD
from ..model.scene import Scene
from ..model.vectors import Vector, clamp_norm
from .input_counts import Tally
from .parameters import Settings

LEVER = 0.1
"""m: a torque may be as strong as the strongest force at this lever."""


class Pushed(Protocol):
    """What is pushed: a simulation, or what stands for the node's where one only listens."""

    scene: Scene

    def push(self, push: Push | Drive, channel: str) -> None:
        """Let a push or drive act in place of the last one of its channel."""

    def release(self, channel: str) -> None:
        """End the push of a channel."""


class Inputs:
    """Subscriptions to all that pushes. Each has a channel: a push takes its last one's place.

    ``name`` is that of the node which is pushed, for who listens beside it. All are reliable: what
    is sent once, as soon as somebody listens, was lost 3 times in 40 to a best-effort subscription.
    """

    def __init__(self, node: Node, tally: Tally, name: str = '~') -> None:
        self._tally = tally
        self.simulation: Pushed
        self.settings: Settings
        self.subscriptions = [
            node.create_subscription(Wrench, f'{name}/force', self.take_force, 10),
            node.create_subscription(Twist, 'cmd_vel', self.take_velocity, 10),
            node.create_subscription(WrenchStamped, f'{name}/push', self.take_push, 10)]

    def take_force(self, message: Wrench) -> None:
        """Push the pushed bone along the world's axes; zero ends the push."""
        settings = self.settings
        self._take('~/force', 'force', settings.pushed_bone, message.force, message.torque,
                   settings.push_timeout)

    def take_velocity(self, message: Twist) -> None:
        """Drive the pushed bone towards a velocity, along the world's axes.

        A part that is zero leaves it free: a doll is passive, and a command to turn does not hold
        it in the air. Zero altogether lets go.
        """
        settings = self.settings
        try:
            linear, angular = (self._limited('cmd_vel', name, vector, MAX_SPEED, 'the most')
                               for name, vector in (('linear', message.linear),
                                                    ('angular', message.angular)))
            if any(linear) or any(angular):
                self.simulation.push(Drive(
                    settings.pushed_bone, linear if any(linear) else None,
                    angular if any(angular) else None,
                    settings.force_per_speed, settings.torque_per_speed,
                    min(MAX_FORCE, settings.max_force),
                    min(MAX_TORQUE, settings.max_force * LEVER),
                    duration=settings.cmd_vel_timeout), 'cmd_vel')
            else:
                self.simulation.release('cmd_vel')
        except errors.ModelError as error:
            self._tally.refuse('cmd_vel', error)

    def take_push(self, message: WrenchStamped) -> None:
        """Push the pushed bone along the world's axes, or the bone named in its own."""
        settings, frame, wrench = self.settings, message.header.frame_id, message.wrench
        local = frame not in (WORLD, settings.frame_id)
        if local and frame not in self.simulation.scene.bone_names:
            expected = ', '.join((WORLD, *self.simulation.scene.bone_names))
            self._tally.refuse('~/push', errors.UnknownBone(
                'header.frame_id', frame, f'one of {expected}'))
            return
        bone = frame if local else settings.pushed_bone
        self._take('~/push', f'push {frame if local else WORLD}', bone, wrench.force,
                   wrench.torque, settings.push_timeout, local=local)

    def _take(self, source: str, channel: str, bone: str, force: Vector3, torque: Vector3,
              duration: float, local: bool = False) -> None:
        most = self.settings.max_force
        try:
            forces = self._limited(source, 'force', force, most, 'max_force')
            torques = self._limited(source, 'torque', torque, most * LEVER, 'max_force')
            if any(forces) or any(torques):
                self.simulation.push(Push(bone, forces, torques, duration=duration, local=local),
                                     channel)
            else:
                self.simulation.release(channel)
        except errors.ModelError as error:
            self._tally.refuse(source, error)

    def _limited(self, source: str, name: str, vector: Vector3, most: float, limit: str) -> Vector:
        """Vector, at most ``most`` long; NotFinite if the message is not finite."""
        values = (vector.x, vector.y, vector.z)
        errors.check_finite(name, values)
        result, length = clamp_norm(values, most)
        if length > most:
            self._tally.clamp(source, f'{name} of {length:g} to {limit}, {most:g}')
        return result
