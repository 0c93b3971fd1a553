"""Pushes of a node: sent by the page, and observed from the topics that the node reads."""
from __future__ import annotations

import threading

from geometry_msgs.msg import Wrench
from rclpy.node import Node

from ....model.drive import Drive
from ....model.push import Push
from ....model.scene import Scene
from ....model.vectors import Vector
from ....ros.inputs.input_counts import InputCounts
from ....ros.messages.convert import to_vector


class ForcePublisher:
    """Publishes ``~/force`` of the node ``name``, which ends a push after its push_timeout."""

    def __init__(self, node: Node, name: str) -> None:
        self._publisher = node.create_publisher(Wrench, f'{name}/force', 10)
        self._timer: threading.Timer | None = None

    def send(self, force: Vector, duration: float) -> None:
        """Push with ``force`` (3,) N, world axes, for ``duration`` s of wall time."""
        self.close()
        self._publisher.publish(Wrench(force=to_vector(force)))
        self._timer = threading.Timer(duration, self._publisher.publish, (Wrench(),))
        self._timer.daemon = True
        self._timer.start()

    def close(self) -> None:
        """Cancel the zero force that would end the last push."""
        if self._timer is not None:
            self._timer.cancel()


class NoInputCounts(InputCounts):
    """Input counts for ros/inputs that count nothing: the node itself reports them."""

    def __init__(self) -> None:
        """Need no logger."""

    def refuse(self, source: str, reason: object) -> None:
        """Do nothing."""

    def clamp(self, source: str, reason: object) -> None:
        """Do nothing."""


class ObservedPushes:
    """Takes the place of the node's simulation in ros/inputs/subscriptions.py."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.time = 0.0
        """Simulated time of the newest poses, s; see set_time()."""
        self._pushes: dict[str, tuple[float, Push]] = {}

    def set_time(self, time: float) -> None:
        """Set the time; pushes end as it goes back, at a reset."""
        if time < self.time:
            self._pushes.clear()
        self.time = time

    def push(self, push: Push | Drive, channel: str) -> None:
        """Start a push in place of the last one of its channel."""
        self._pushes[channel] = (self.time, push.at_rest if isinstance(push, Drive) else push)

    def release(self, channel: str) -> None:
        """End the push of a channel."""
        self._pushes.pop(channel, None)

    @property
    def pushes(self) -> tuple[Push, ...]:
        """Pushes that act at the time of the newest poses."""
        return tuple(push for start, push in list(self._pushes.values())
                     if start <= self.time < start + push.duration)
