"""A push that is sent: a force, and zero once it has acted for as long as it shall."""
from __future__ import annotations

import threading

from geometry_msgs.msg import Vector3, Wrench
from rclpy.node import Node

from ....model.vectors import Vector


class RemoteForce:
    """Sends on ``~/force`` of the node ``name``, which lets go after its push_timeout anyway."""

    def __init__(self, node: Node, name: str) -> None:
        self._publisher = node.create_publisher(Wrench, f'{name}/force', 10)
        self._end = threading.Timer(0.0, self._publish)

    def send(self, force: Vector, duration: float) -> None:
        """Push with ``force`` (3,) N, world axes, for ``duration`` s on the wall."""
        self.close()
        x, y, z = force
        self._publish(Wrench(force=Vector3(x=x, y=y, z=z)))
        self._end = threading.Timer(duration, self._publish)
        self._end.daemon = True
        self._end.start()

    def close(self) -> None:
        """Send nothing any more."""
        self._end.cancel()

    def _publish(self, wrench: Wrench | None = None) -> None:
        self._publisher.publish(wrench or Wrench())
