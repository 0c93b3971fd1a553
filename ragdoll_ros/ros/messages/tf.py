"""The links' frames on /tf, if tf2_msgs is installed."""
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
from .serialized import SerializedTemplate

if TYPE_CHECKING:  # else the page, which reads outputs.py, would load an engine
    from ...physics.simulation import Simulation

try:
    from tf2_msgs.msg import TFMessage
except ImportError as error:  # not on PyPI, which has the rest of ROS
    TFMessage, MISSING = None, str(error)

PUBLISH_TF = ('all', 'root', 'none')
"""Values of the parameter: frames of all links, of each doll's root link only, no frames."""

DEPTH = 100
"""Queue depth, that of tf2_ros."""


class TfTemplate:
    """Template of the TFMessage of a scene's links."""

    def __init__(self, scene: Scene, frame: str, roots_only: bool) -> None:
        self._tree = LinkTree(scene, frame, roots_only)
        self._template = SerializedTemplate.trace(partial(to_tf, self._tree.edges),
                                                  (len(self._tree.edges), 7))

    def serialize(self, simulation: Simulation, stamp: int) -> bytes:
        """Serialized TFMessage of the current state; stamp in ns."""
        return self._template.serialize(
            stamp, self._tree.poses(simulation.state, simulation.joint_angles))


class TfPublisher:
    """The publisher of /tf; publishes only while subscribed."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._publisher: Publisher | None = None
        self._template: TfTemplate | None = None
        self._is_told = False

    def prepare(self, scene: Scene, frame: str, publish_tf: str) -> TfTemplate | None:
        """Return a template for the next scene if there is one for the present scene, else None.
        This may run beside the ticks.
        """
        return TfTemplate(scene, frame, publish_tf == 'root') if self._template else None

    def set_scene(self, scene: Scene, frame: str, publish_tf: str,
                  template: TfTemplate | None = None) -> None:
        """Publish a scene's frames from now on. ``frame`` names the world frame; ``publish_tf`` is
        one of PUBLISH_TF; ``template`` is what prepare() returned.
        """
        self._make_template = partial(TfTemplate, scene, frame, publish_tf == 'root')
        self._template = template
        self._subscribers = 0
        if publish_tf == 'none' and self._publisher is not None:
            self._node.destroy_publisher(self._publisher)
            self._publisher = None
        elif publish_tf != 'none' and TFMessage is None:
            if not self._is_told:
                self._is_told = True
                self._node.get_logger().info(
                    f'/tf is not published, as tf2_msgs is not installed: {MISSING}')
        elif publish_tf != 'none' and self._publisher is None:
            self._publisher = self._node.create_publisher(TFMessage, '/tf', DEPTH)

    @property
    def has_subscribers(self) -> bool:
        """Whether there was a subscriber at the last publication."""
        return self._subscribers > 0

    def publish(self, simulation: Simulation, stamp: int) -> None:
        """Publish the frames of the current state; stamp in ns."""
        self._subscribers = self._count_subscribers()
        if self._subscribers:
            self._template = self._template or self._make_template()
            self._publisher.publish(self._template.serialize(simulation, stamp))

    def republish(self, simulation: Simulation, stamp: int) -> None:
        """While paused, publish again, but only for a new subscriber: tf2 warns of old stamps."""
        before, self._subscribers = self._subscribers, self._count_subscribers()
        if self._subscribers > before:
            self.publish(simulation, stamp)

    def _count_subscribers(self) -> int:
        return self._publisher.get_subscription_count() if self._publisher else 0


def to_tf(edges: list[tuple[str, str]], stamp: int, poses: np.ndarray) -> TFMessage:
    """TFMessage of frames (parent, child) at poses (m, 7) relative to their parents."""
    return TFMessage(transforms=[
        TransformStamped(header=to_header(stamp, parent), child_frame_id=child,
                         transform=to_transform(row))
        for (parent, child), row in zip(edges, poses.tolist(), strict=True)])
