"""Hands that reach over ROS: what RViz would send if a bone's interactive marker were dragged."""
from __future__ import annotations

import os
import socket
from dataclasses import dataclass

import numpy as np
from geometry_msgs.msg import Pose
from rclpy.node import Node
from std_msgs.msg import Header
from visualization_msgs.msg import InteractiveMarkerFeedback

from ....model import rotation
from ....model.scene import Scene
from ....model.state import State
from ....ros.messages.convert import to_point, to_quaternion
from ..source import Frame, Held


@dataclass
class _Hand:
    bone: str
    local: np.ndarray
    """(3,) m: the grabbed point from the bone's centre, its axes."""
    begin: np.ndarray
    """(3,) m, world: where that was when it was grabbed."""
    pose: np.ndarray
    """(7,) the bone's then."""
    target: np.ndarray


class RemoteHands:
    """Grabs as feedback of the bones' markers: the pointer's displacement is the marker's."""

    def __init__(self, node: Node, name: str) -> None:
        self._node = node
        self._publisher = node.create_publisher(
            InteractiveMarkerFeedback, f'{name}/interactive/feedback', 10)
        self._client = f'{socket.gethostname()} {os.getpid()}'
        self._hands: dict[str, _Hand] = {}
        self.frame_id = 'world'
        self.moves = 0
        """How often a hand was moved so far."""

    def grab(self, hand: str, bone: str, local: np.ndarray, target: np.ndarray,
             frame: Frame) -> None:
        """Take a bone of the frame that is shown at a point of its own axes."""
        self.let_go(hand)
        index = frame.scene.bone_index(bone)
        position, orientation = frame.state.positions[index], frame.state.orientations[index]
        point = position + rotation.rotate(orientation, local)
        pose = np.concatenate([position, orientation])
        self._hands[hand] = held = _Hand(bone, local, point, pose, point)
        self._send(hand, held, InteractiveMarkerFeedback.MOUSE_DOWN)
        self.drag(hand, target)

    def drag(self, hand: str, target: np.ndarray) -> None:
        """Move a hand that holds something."""
        held = self._hands.get(hand)
        if held is not None:
            held.target = target
            self._send(hand, held, InteractiveMarkerFeedback.POSE_UPDATE)

    def let_go(self, hand: str) -> None:
        """Open a hand."""
        held = self._hands.pop(hand, None)
        if held is not None:
            self._send(hand, held, InteractiveMarkerFeedback.MOUSE_UP)

    def forget(self) -> None:
        """Hold nothing any more: the node has let go, or is another one."""
        self._hands.clear()
        self.moves += 1

    def keep(self) -> None:
        """Tell that hands which rest still hold; to be called about once a second."""
        for hand, held in list(self._hands.items()):
            self._send(hand, held, InteractiveMarkerFeedback.KEEP_ALIVE)

    def held(self, scene: Scene, state: State) -> tuple[Held, ...]:
        """What the hands hold now."""
        names = scene.bone_names
        return tuple(Held(
            hand.bone, state.positions[bone] + rotation.rotate(
                state.orientations[bone], hand.local), hand.target)
            for hand in list(self._hands.values()) if hand.bone in names
            for bone in (names.index(hand.bone),))

    def _send(self, hand: str, held: _Hand, event: int) -> None:
        self.moves += 1
        place = held.pose[:3] + held.target - held.begin
        orientation = to_quaternion(held.pose[3:])
        self._publisher.publish(InteractiveMarkerFeedback(
            header=Header(stamp=self._node.get_clock().now().to_msg(), frame_id=self.frame_id),
            client_id=f'{self._client} {hand}', marker_name=held.bone, control_name=held.bone,
            event_type=event, pose=Pose(position=to_point(place), orientation=orientation),
            mouse_point=to_point(held.target), mouse_point_valid=True))
