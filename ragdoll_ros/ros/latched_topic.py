"""Topics that are published with each tick: QoS overrides, and what late subscribers get."""
from __future__ import annotations

import copy

from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions

from ..model.errors import RagdollError

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""For topics whose last message is all that late subscribers need."""

LATCHED_HISTORY = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""For topics that are silent while paused: late subscribers get the last messages. Fewer could be
lost on their way, as a message that is not yet acknowledged makes room for a new one."""

TICK_HISTORY = QoSProfile(depth=50, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""For small messages of each tick, of which none is to be lost: what is lost on its way is sent
again while it is kept. Where a fifth of all packets is lost (test_ros_lossy.py), 9 of 5 600 ticks
are with a depth of 10, none with this one. A late subscriber waits no longer for it."""


class InvalidQosOverride(RagdollError):
    """A parameter qos_overrides.* with a value that no policy has."""


def overridable_publisher(node: Node, kind: type, name: str, qos: QoSProfile | int) -> Publisher:
    """A publisher whose history, depth and reliability users set by qos_overrides parameters.

    Raises InvalidQosOverride.
    """
    try:
        # rclpy writes the overrides into the profile that it is given.
        return node.create_publisher(
            kind, name, copy.copy(qos),
            qos_overriding_options=QoSOverridingOptions.with_default_policies())
    except RuntimeError as error:
        raise InvalidQosOverride(f'{name}: {error}') from None


def has_subscribers(publisher: Publisher) -> bool:
    """Whether anybody listens. This is asked of ten publishers each tick, and rclpy's method takes
    three times as long, as it guards against a destruction by another thread.
    """
    return publisher.handle.get_subscription_count() > 0


class LatchedTopic:
    """A publisher of ``kind`` on ``name`` from which late subscribers get the last messages.

    To be used while there are subscribers; else forget() is to be called, as old messages would be
    wrong for the next subscriber.
    """

    def __init__(self, node: Node, kind: type, name: str, qos: QoSProfile = TICK_HISTORY) -> None:
        self._node, self._kind, self._name, self._qos = node, kind, name, qos
        self._has_history = False
        self._publisher = self._made()

    @property
    def has_subscribers(self) -> bool:
        """Whether anybody listens."""
        return has_subscribers(self._publisher)

    def publish(self, message: object) -> None:
        """Publish a message, also for those who come later; serialized or not."""
        self._has_history = True
        self._publisher.publish(message)

    def forget(self) -> None:
        """Forget past messages: there is a newer state, which is not published."""
        if self._has_history:
            self._has_history = False
            # A writer's history cannot be emptied otherwise.
            self._node.destroy_publisher(self._publisher)
            self._publisher = self._made()

    def destroy(self) -> None:
        """End the topic."""
        self._node.destroy_publisher(self._publisher)

    def _made(self) -> Publisher:
        return overridable_publisher(self._node, self._kind, self._name, self._qos)
