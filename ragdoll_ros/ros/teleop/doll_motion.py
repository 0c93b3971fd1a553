"""Mass and velocity of the doll that is pushed, from what a node publishes."""
from __future__ import annotations

import contextlib
from collections.abc import Callable

import numpy as np
from rclpy.node import Node
from sensor_msgs.msg import MultiDOFJointState
from std_msgs.msg import String

from ...files.robots.urdf_tree import parse_urdf
from ...model.errors import RagdollError
from ..latched_topic import LATCHED


class DollMotion:
    """The first doll of the node of a fully qualified ``name``, whose root is the pushed bone by
    default. ``state`` gives the node's last state, or None.
    """

    def __init__(self, node: Node, name: str,
                 state: Callable[[], MultiDOFJointState | None]) -> None:
        self._state = state
        self._masses: dict[str, float] = {}
        self._roots: set[str] = set()
        self.scene = ''
        """Name of the scene; empty if it is not known."""
        namespace = name.rsplit('/', 1)[0]
        self.subscription = node.create_subscription(
            String, f'{namespace}/robot_description', self._take, LATCHED)

    @property
    def mass(self) -> float:
        """Mass of the doll, kg; 0 if it is not known."""
        return float(self._rows()[1].sum())

    def speed(self, direction: np.ndarray) -> float:
        """Speed, m/s, along a unit vector (3,): that of the root or of the doll's centre of mass,
        whichever is larger. The doll must have a mass.
        """
        names, masses, velocities = self._rows()
        speeds = velocities @ direction
        root = next((k for k, name in enumerate(names) if name in self._roots), 0)
        return float(max(speeds[root], masses @ speeds / masses.sum()))

    def _rows(self) -> tuple[list[str], np.ndarray, np.ndarray]:
        """Names, masses (n,) kg and velocities (n, 3) m/s of the doll's bones, in the order of
        ~/state.
        """
        state = self._state()
        if state is None or not state.joint_names:
            return [], np.zeros(0), np.zeros((0, 3))
        first = state.joint_names[0].rpartition('/')[0]
        own = [k for k, name in enumerate(state.joint_names)
               if name.rpartition('/')[0] == first and name in self._masses]
        twists = [state.twist[k].linear for k in own]
        names = [state.joint_names[k] for k in own]
        return (names, np.array([self._masses[name] for name in names]),
                np.array([(twist.x, twist.y, twist.z) for twist in twists]).reshape(-1, 3))

    def _take(self, message: String) -> None:
        # A description that cannot be read leaves the masses unknown.
        with contextlib.suppress(RagdollError):
            robot = parse_urdf(message.data)
            self.scene = robot.name
            self._masses = {name: link.mass for name, link in robot.links.items()}
            self._roots = {name for name in robot.links if name not in robot.joints
                           or robot.joints[name].kind == 'floating'}
