"""Strengths of motors that the page sets."""
from __future__ import annotations

import threading

from rclpy.node import Node
from std_msgs.msg import Float64


class StrengthPublisher:
    """Publishes ``~/motor_strength`` of the node ``name``.

    The newest strength waits until a subscription is matched: a message sent before is lost.
    """

    def __init__(self, node: Node, name: str) -> None:
        self._publisher = node.create_publisher(Float64, f'{name}/motor_strength', 10)
        self._unsent: float | None = None
        self._lock = threading.Lock()

    def send(self, strength: float) -> None:
        """Set the strength, 0 to 1, of all motors."""
        with self._lock:
            self._unsent = float(strength)
        self.retry()

    def retry(self) -> None:
        """Send what waits, if a subscription is matched."""
        with self._lock:
            if self._unsent is not None and self._publisher.get_subscription_count():
                self._publisher.publish(Float64(data=self._unsent))
                self._unsent = None
