"""Other nodes of the same name: their messages mix with this one's, and ROS says no word."""
from __future__ import annotations

from rclpy.node import Node


class Namesakes:
    """Counts other nodes with the name and namespace of ``node``; the log tells when more come."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self.count = 0

    def look(self) -> None:
        """Look at the graph; now and then, by a timer that is there anyway."""
        node = self._node
        own = node.get_name(), node.get_namespace()
        before, self.count = self.count, max(
            0, node.get_node_names_and_namespaces().count(own) - 1)
        if self.count > before:
            node.get_logger().warning(
                f'{self.count + 1} nodes are called {node.get_fully_qualified_name()}: their '
                'messages mix; end all but one, or start each in a namespace of its own: '
                '--ros-args -r __ns:=/other')
