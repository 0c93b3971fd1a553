"""Which node a teleop steers: that of its own namespace, or else the only one that there is."""
from __future__ import annotations

from rclpy.node import Node
from rclpy.validate_topic_name import validate_topic_name

OWN = {'/poses': 'geometry_msgs/msg/PoseArray', '/force': 'geometry_msgs/msg/Wrench'}
"""Topics of a node that simulates a doll, by the end of their names."""


class Followed:
    """The full ``name`` of a node that simulates a doll, whatever it is called.

    ``asked``: its name, if a user said which; '': ``ragdoll``, until that is not there and another
    one is. Raises rclpy's InvalidTopicNameException for what cannot be a name.
    """

    def __init__(self, node: Node, asked: str) -> None:
        self._node, self._fixed = node, bool(asked)
        validate_topic_name(asked or 'ragdoll')
        self.name = node.resolve_topic_name(asked or 'ragdoll')
        self.problem = ''
        """Why it is not known which."""
        self._found: list[str] = []

    def look(self) -> bool:
        """Look at the graph, now and then; whether it is another one from now on."""
        self.problem = ''
        if self._fixed or self._is_there(self.name):
            return False
        # Not all are discovered at once: what was found counts when it is found again.
        before, self._found = self._found, self._simulating()
        found = self._found
        if len(found) > 1:
            self.problem = f'several nodes: {", ".join(found)}; ragdoll_teleop {found[0]} takes one'
        if len(found) != 1 or found != before:
            return False
        self.name = found[0]
        return True

    def _simulating(self) -> list[str]:
        kinds = dict(self._node.get_topic_names_and_types())
        names = (topic[:-len('/poses')] for topic in sorted(kinds) if topic.endswith('/poses'))
        return [name for name in names if self._is_there(name)
                and all(kind in kinds.get(name + end, ()) for end, kind in OWN.items())]

    def _is_there(self, name: str) -> bool:
        return self._node.count_publishers(f'{name}/poses') > 0
