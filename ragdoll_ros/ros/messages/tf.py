"""Frames of the links on /tf, where tf2_msgs is installed."""
from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from rclpy.publisher import Publisher

from ...model.scene import Scene
from .convert import to_header, to_transform
from .link_tree import LinkTree
from .serialized import Packed

if TYPE_CHECKING:  # else the page, which reads outputs.py, would load an engine
    from ...physics.simulation import Simulation

try:
    from tf2_msgs.msg import TFMessage
except ImportError as error:  # PyPI, which has the rest of ROS, has none
    TFMessage, MISSING = None, str(error)

TREES = ('all', 'root', 'none')
"""What is published: the frames of all links, of each doll's root alone, of nothing."""

DEPTH = 100
"""As tf2_ros has it."""


class Frames:
    """The TFMessage of a tree of links."""

    def __init__(self, scene: Scene, frame: str, roots_alone: bool) -> None:
        self._tree = LinkTree(scene, frame, roots_alone)
        self._packed = Packed(partial(to_tf, self._tree.edges), (len(self._tree.edges), 7))

    def message(self, simulation: Simulation, stamp: int) -> bytes:
        """Serialized, as the simulation is; stamp in ns."""
        return self._packed.message(
            stamp, self._tree.poses(simulation.state, simulation.joint_angles))


class Transforms:
    """The publisher of /tf, and what goes out through it while somebody listens."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._publisher: Publisher | None = None
        self._told = False

    def describe(self, scene: Scene, frame: str, tree: str) -> None:
        """Make ready for a scene in the world's ``frame``; ``tree`` is one of TREES."""
        self._make = partial(Frames, scene, frame, tree == 'root')
        self._frames: Frames | None = None
        self._listeners = 0
        if tree == 'none' and self._publisher is not None:
            self._node.destroy_publisher(self._publisher)
            self._publisher = None
        elif tree != 'none' and TFMessage is None:
            self._tell_missing()
        elif tree != 'none' and self._publisher is None:
            self._publisher = self._node.create_publisher(TFMessage, '/tf', DEPTH)

    @property
    def heard(self) -> bool:
        """Whether somebody listened as it was last published."""
        return self._listeners > 0

    def publish(self, simulation: Simulation, stamp: int) -> None:
        """Publish where the links are; stamp in ns."""
        self._listeners = self._count()
        if self._listeners:
            self._frames = self._frames or self._make()
            self._publisher.publish(self._frames.message(simulation, stamp))

    def repeat(self, simulation: Simulation, stamp: int) -> None:
        """Publish once more what stands, if somebody has come: /tf keeps nothing for who is late,
        and who has it already would complain of the same stamp.
        """
        before, self._listeners = self._listeners, self._count()
        if self._listeners > before:
            self.publish(simulation, stamp)

    def _count(self) -> int:
        return self._publisher.get_subscription_count() if self._publisher else 0

    def _tell_missing(self) -> None:
        if not self._told:
            self._told = True
            self._node.get_logger().info(f'/tf is not published, as tf2_msgs is not installed: '
                                         f'{MISSING}')


def to_tf(edges: list[tuple[str, str]], stamp: int, poses: np.ndarray) -> TFMessage:
    """Frames of (parent, child) at poses (m, 7) in their parents', in the plain way."""
    return TFMessage(transforms=[
        TransformStamped(header=to_header(stamp, parent), child_frame_id=child,
                         transform=to_transform(row))
        for (parent, child), row in zip(edges, poses.tolist(), strict=True)])
