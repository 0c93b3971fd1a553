"""Finds the node to steer: `ragdoll` in the own namespace, or else the only one in the graph."""
from __future__ import annotations

from rclpy.node import Node
from rclpy.validate_topic_name import validate_topic_name

TOPIC_TYPES = {'/poses': 'geometry_msgs/msg/PoseArray', '/force': 'geometry_msgs/msg/Wrench'}
"""Topics by which a ragdoll node is recognized, relative to its name."""


class NodeFinder:
    """The fully qualified ``name`` of a ragdoll node.

    ``requested``: the name the user gave; '': ``ragdoll``, or another ragdoll node if that is not
    there. Raises rclpy's InvalidTopicNameException for an invalid name.
    """

    def __init__(self, node: Node, requested: str) -> None:
        self._node, self._fixed = node, bool(requested)
        validate_topic_name(requested or 'ragdoll')
        self.name = node.resolve_topic_name(requested or 'ragdoll')
        self.problem = ''
        """Why no node can be chosen."""
        self._found: list[str] = []

    def update(self) -> bool:
        """Check the ROS graph; to be called periodically. Returns whether ``name`` has changed."""
        self.problem = ''
        if self._fixed or self._exists(self.name):
            return False
        # Discovery takes time: a result counts when the next check confirms it.
        before, self._found = self._found, self._ragdoll_nodes()
        found = self._found
        if len(found) > 1:
            self.problem = (f'several nodes: {", ".join(found)}; choose one: '
                            f'ragdoll_teleop {found[0]}')
        if len(found) != 1 or found != before:
            return False
        self.name = found[0]
        return True

    def _ragdoll_nodes(self) -> list[str]:
        types = dict(self._node.get_topic_names_and_types())
        names = (topic[:-len('/poses')] for topic in sorted(types) if topic.endswith('/poses'))
        return [name for name in names if self._exists(name)
                and all(kind in types.get(name + end, ()) for end, kind in TOPIC_TYPES.items())]

    def _exists(self, name: str) -> bool:
        return self._node.count_publishers(f'{name}/poses') > 0
