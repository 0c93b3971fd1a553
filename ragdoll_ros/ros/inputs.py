"""Messages that push: from Wrench, Twist and WrenchStamped to Push.

What is not finite or names no bone is refused, what is too strong is clamped to its direction;
both are counted, and the doll goes on.
"""
from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

from geometry_msgs.msg import Twist, Vector3, Wrench, WrenchStamped
from rclpy.node import Node

from ..model import errors
from ..model.push import Push
from ..model.ragdoll import WORLD
from ..model.scene import Scene
from ..model.vectors import Vector
from .parameters import Settings
from .tally import Tally

LEVER = 0.1
"""m: a torque may be as strong as the strongest force at this lever."""


class Pushed(Protocol):
    """What is pushed: a simulation, or what stands for the node's where one only listens."""

    scene: Scene

    def push(self, push: Push, channel: str) -> None:
        """Let a push act in place of the last one of its channel."""

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
        """Push the pushed bone in proportion to a wanted velocity, along the world's axes."""
        settings = self.settings
        self._take('cmd_vel', 'cmd_vel', settings.pushed_bone, message.linear, message.angular,
                   settings.cmd_vel_timeout,
                   (settings.force_per_speed, settings.torque_per_speed))

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
              duration: float, scales: tuple[float, float] = (1.0, 1.0),
              local: bool = False) -> None:
        try:
            forces = self._limited(source, 'force', force, scales[0], self.settings.max_force)
            torques = self._limited(source, 'torque', torque, scales[1],
                                    self.settings.max_force * LEVER)
            if any(forces) or any(torques):
                self.simulation.push(Push(bone, forces, torques, duration=duration, local=local),
                                     channel)
            else:
                self.simulation.release(channel)
        except errors.ModelError as error:
            self._tally.refuse(source, error)

    def _limited(self, source: str, name: str, vector: Vector3, scale: float,
                 most: float) -> Vector:
        """Vector times scale, at most ``most`` long; NotFinite if the message is not finite."""
        values = (vector.x, vector.y, vector.z)
        errors.check_finite(name, values)
        result, length = shortened(values, scale, most)
        if length > most:
            self._tally.clamp(source, f'{name} of {length:g} to max_force, {most:g}')
        return result


def shortened(values: Sequence[float], scale: float, most: float) -> tuple[Vector, float]:
    """A finite vector times ``scale``, at most ``most`` long, and the length it would have had.

    The vector is first divided by its largest component, so that nothing overflows on the way.
    """
    largest = max(map(abs, values))
    if largest == 0 or scale == 0:
        return (0.0, 0.0, 0.0), 0.0
    direction = [value / largest for value in values]
    spread = math.hypot(*direction)
    length = largest * scale * spread
    if length <= most:
        return tuple(value * scale for value in values), length
    return tuple(value * (most / spread) for value in direction), length
