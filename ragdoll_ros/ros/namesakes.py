"""Other nodes of the same name: their messages mix with this one's, and ROS says no word."""
from __future__ import annotations

from rclpy.clock import Clock
from rclpy.node import Node

PERIOD = 2.0
"""s of the steady clock between two looks at the graph."""


class Namesakes:
    """Counts other nodes with the name and namespace of ``node``; the log tells when more come."""

    def __init__(self, node: Node, steady: Clock) -> None:
        self._node = node
        self.count = 0
        node.create_timer(PERIOD, self._look, clock=steady)

    def _look(self) -> None:
        node = self._node
        own = node.get_name(), node.get_namespace()
        before, self.count = self.count, max(
            0, node.get_node_names_and_namespaces().count(own) - 1)
        if self.count > before:
            node.get_logger().warning(
                f'{self.count + 1} nodes are called {node.get_fully_qualified_name()}: their '
                'messages mix; give one a namespace, --ros-args -r __ns:=/other')
