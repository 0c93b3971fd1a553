"""Sends pushes of limited duration to a node: a force, and later a zero force."""
from __future__ import annotations

import threading

from geometry_msgs.msg import Vector3, Wrench
from rclpy.node import Node

from ....model.vectors import Vector


class ForcePublisher:
    """Publishes ``~/force`` of the node ``name``, which ends a push after its push_timeout."""

    def __init__(self, node: Node, name: str) -> None:
        self._publisher = node.create_publisher(Wrench, f'{name}/force', 10)
        self._timer = threading.Timer(0.0, self._publish)

    def send(self, force: Vector, duration: float) -> None:
        """Push with ``force`` (3,) N, world axes, for ``duration`` s of wall time."""
        self.close()
        x, y, z = force
        self._publish(Wrench(force=Vector3(x=x, y=y, z=z)))
        self._timer = threading.Timer(duration, self._publish)
        self._timer.daemon = True
        self._timer.start()

    def close(self) -> None:
        """Cancel the zero force that would end the last push."""
        self._timer.cancel()

    def _publish(self, wrench: Wrench | None = None) -> None:
        self._publisher.publish(wrench or Wrench())
