"""Hands over ROS: the same feedback that RViz sends when an interactive marker is dragged."""
from __future__ import annotations

import os
import socket
from dataclasses import dataclass

import numpy as np
from rclpy.node import Node
from std_msgs.msg import Header
from visualization_msgs.msg import InteractiveMarkerFeedback

from ....model.pose import Pose
from ....model.scene import Scene
from ....model.state import State
from ....ros.messages.convert import to_point, to_pose
from ..source import Frame, GrabbedPoint


@dataclass
class _Hand:
    bone: str
    local: np.ndarray
    """(3,) m: the grabbed point in the bone's frame."""
    pose: Pose
    """Of the bone when it was grabbed."""
    target: np.ndarray


class NodeHands:
    """Sends grabs as feedback of the bones' interactive markers.

    A marker is displaced as its target is from the grabbed point.
    """

    def __init__(self, node: Node, name: str) -> None:
        self._node = node
        self._publisher = node.create_publisher(
            InteractiveMarkerFeedback, f'{name}/interactive/feedback', 10)
        self._client = f'{socket.gethostname()} {os.getpid()}'
        self._hands: dict[str, _Hand] = {}
        self.frame_id = 'world'
        self.moves = 0
        """Count of hand moves."""

    def grab(self, hand: str, bone: str, local: np.ndarray, target: np.ndarray,
             frame: Frame) -> None:
        """Grab a bone of the shown frame at a point of the bone's frame, if that is finite."""
        self.let_go(hand)
        if not (np.isfinite(local).all() and np.isfinite(target).all()):
            return
        pose = frame.state.poses(frame.scene.bone_index(bone))
        self._hands[hand] = grab = _Hand(bone, local, pose, pose.apply(local))
        self._send(hand, grab, InteractiveMarkerFeedback.MOUSE_DOWN)
        self.drag(hand, target)

    def drag(self, hand: str, target: np.ndarray) -> None:
        """Move the target of a hand that holds something."""
        grab = self._hands.get(hand)
        if grab is not None and np.isfinite(target).all():
            grab.target = target
            self._send(hand, grab, InteractiveMarkerFeedback.POSE_UPDATE)

    def let_go(self, hand: str) -> None:
        """Release what a hand holds."""
        grab = self._hands.pop(hand, None)
        if grab is not None:
            self._send(hand, grab, InteractiveMarkerFeedback.MOUSE_UP)

    def clear(self) -> None:
        """Drop all grabs without feedback: the node has released them, or is another one."""
        self._hands.clear()
        self.moves += 1

    def keep_alive(self) -> None:
        """Confirm the grabs of resting hands; call about once a second."""
        for hand, grab in list(self._hands.items()):
            self._send(hand, grab, InteractiveMarkerFeedback.KEEP_ALIVE)

    def grabs(self, scene: Scene, state: State) -> tuple[GrabbedPoint, ...]:
        """The points that are held now."""
        names = scene.bone_names
        return tuple(GrabbedPoint(
            hand.bone, state.poses(names.index(hand.bone)).apply(hand.local), hand.target)
            for hand in list(self._hands.values()) if hand.bone in names)

    def _send(self, hand: str, grab: _Hand, event: int) -> None:
        self.moves += 1
        position = grab.pose.position + grab.target - grab.pose.apply(grab.local)
        self._publisher.publish(InteractiveMarkerFeedback(
            header=Header(stamp=self._node.get_clock().now().to_msg(), frame_id=self.frame_id),
            client_id=f'{self._client} {hand}', marker_name=grab.bone, control_name=grab.bone,
            event_type=event, pose=to_pose((*position, *grab.pose.orientation)),
            mouse_point=to_point(grab.target), mouse_point_valid=True))
