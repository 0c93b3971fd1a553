"""Dragging bones over ROS, by the protocol of RViz's interactive markers.

One marker a bone, named as the bone, its pose that of the bone's centre of mass. A client (RViz,
a web page) calls the service once, follows the updates, and sends feedback:

- MOUSE_DOWN: a hand takes the bone ``marker_name`` at ``mouse_point``, or at its centre of mass
  if that is not valid; ``pose`` is the marker's as the client showed it then.
- POSE_UPDATE: the client moved the marker to ``pose``; the hand goes to where the point that it
  holds is on a bone of that pose. Of a client that holds nothing, nothing.
- KEEP_ALIVE: the hand stays where it is.
- MOUSE_UP: the hand lets go.

``header.frame_id`` is the scene's frame, or ``world``. Hands are told apart by ``client_id`` and
``marker_name``, as two RViz have the same id: many clients can drag at once, also one bone. A
client that has not been heard of for VANISHED is taken to be gone. Feedback that is none of this
is refused and counted.

As RViz Jazzy does it (rviz_default_plugins, interactive_markers 2.5): it asks for
``<namespace>/get_interactive_markers``, then expects each update's ``seq_num`` to be one more
than the last and begins anew if it is not, or if an update has a pose for a marker it does not
know. Keep-alive updates are no longer wanted. Both topics are reliable, 100 deep. While it drags,
it sends a POSE_UPDATE with every frame, and does not move that marker by what we send.
"""
from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from geometry_msgs.msg import Pose
from rclpy.node import Node
from visualization_msgs.msg import InteractiveMarkerFeedback, InteractiveMarkerUpdate
from visualization_msgs.srv import GetInteractiveMarkers

from ..model import errors, rotation
from ..model.ragdoll import WORLD
from ..physics.actions.grab import DRAG_TIME
from ..physics.simulation import Simulation
from .input_counts import Tally
from .messages.interactive_markers import Handles
from .outputs import MARKER_PERIOD
from .parameters import Settings

DEPTH = 100
"""Messages that wait at the most on either topic, as with interactive_markers' own server."""

VANISHED = 3_000_000_000
"""ns of the steady clock after which a client that drags and says nothing is gone. RViz says
nothing while Shift is held and the mouse rests, which should not drop the bone at once."""

FEEDBACK = '~/interactive/feedback'


@dataclass
class _Drag:
    """What a client drags: the point (3,) m of the bone, in its axes, and when it was heard."""

    point: np.ndarray
    heard: int


class Interactive:
    """Serves the markers and lets feedback move the simulation's hands.

    ``now`` gives the ns of a steady clock.
    """

    def __init__(self, node: Node, tally: Tally, now: Callable[[], int]) -> None:
        self._tally, self._now = tally, now
        self._server = node.get_fully_qualified_name()
        self._handles: Handles | None = None
        self._sequence = 0
        self._next = 0
        self._drags: dict[str, _Drag] = {}
        self._simulation: Simulation | None = None
        self.settings: Settings
        self._updates = node.create_publisher(InteractiveMarkerUpdate, '~/interactive/update',
                                              DEPTH)
        node.create_subscription(InteractiveMarkerFeedback, FEEDBACK, self.take, DEPTH)
        node.create_service(GetInteractiveMarkers, '~/interactive/get_interactive_markers',
                            self._answer)

    def use(self, simulation: Simulation, settings: Settings) -> None:
        """Show the markers of this simulation's scene, and erase those of the last one's."""
        last = frozenset() if self._handles is None else self._handles.names
        if simulation is not self._simulation:
            self._drags.clear()
        self._simulation, self.settings = simulation, settings
        handles = self._handles = Handles(simulation.scene, settings.frame_id, self._server)
        self._sequence += 1
        if self._updates.get_subscription_count():
            self._updates.publish(handles.to_update(
                self._sequence, markers=handles.markers(simulation.state),
                erases=sorted(last - handles.names)))

    def publish(self, now: int, still: bool = False) -> None:
        """Publish where the markers are at ``now``, and let go for clients that are gone.

        ``still``: nothing may follow, so that markers can not wait.
        """
        for hand, drag in list(self._drags.items()):
            if now - drag.heard > VANISHED:
                self._let_go(hand)
        if still or now >= self._next:
            self._next = now + MARKER_PERIOD
            self.publish_poses()

    def publish_poses(self) -> None:
        """Publish where the markers are, now, if somebody listens."""
        if self._updates.get_subscription_count():
            self._sequence += 1
            self._updates.publish(self._handles.update(self._sequence, self._simulation.state))

    def take(self, message: InteractiveMarkerFeedback) -> None:
        """Move a hand as a client wants it; see the table above."""
        try:
            self._take(message)
        except errors.ModelError as error:
            self._tally.refuse(FEEDBACK, error)

    def _take(self, message: InteractiveMarkerFeedback) -> None:
        self._check(message)
        position, orientation = _pose(message.pose)
        hand = f'{message.client_id} {message.marker_name}'
        kind, drag = message.event_type, self._drags.get(hand)
        if kind == message.MOUSE_DOWN:
            self._grab(hand, message, position, orientation)
        elif kind == message.MOUSE_UP:
            self._let_go(hand)
        elif drag is not None:
            drag.heard = self._now()
            if kind == message.POSE_UPDATE:
                self._simulation.drag(hand, position + rotation.rotate(orientation, drag.point),
                                      DRAG_TIME * self.settings.real_time_factor)

    def _check(self, message: InteractiveMarkerFeedback) -> None:
        """Refuse what is for no bone, in another frame or of another kind."""
        frame = message.header.frame_id
        if message.marker_name not in self._handles.names:
            names = self._simulation.scene.bone_names
            raise errors.UnknownBone('marker_name', message.marker_name,
                                     f'one of {", ".join(names)}')
        if frame not in (WORLD, self.settings.frame_id):
            raise errors.OutOfRange('header.frame_id', frame, self.settings.frame_id)
        if message.event_type not in (message.KEEP_ALIVE, message.POSE_UPDATE,
                                      message.MOUSE_DOWN, message.MOUSE_UP):
            raise errors.OutOfRange('event_type', message.event_type,
                                    'KEEP_ALIVE, POSE_UPDATE, MOUSE_DOWN or MOUSE_UP')

    def _grab(self, hand: str, message: InteractiveMarkerFeedback, position: np.ndarray,
              orientation: np.ndarray) -> None:
        """Take a bone; a point beside it, in a ghost's rim or in another's way, is moved onto it.

        The point is seen from the pose that the client showed, as the bone may have gone on.
        """
        bone = message.marker_name
        point, target = np.zeros(3), position
        if message.mouse_point_valid:
            target = _vector('mouse_point', message.mouse_point)
            point = rotation.rotate(rotation.inverse(orientation), target - position)
        scene = self._simulation.scene
        half = np.array(scene.bones[scene.bone_index(bone)].shape.half_extents)
        point = np.clip(point, -half, half)
        self._simulation.grab(hand, bone, point, target)
        self._drags[hand] = _Drag(point, self._now())

    def _let_go(self, hand: str) -> None:
        self._simulation.let_go(hand)
        self._drags.pop(hand, None)

    def _answer(self, _: GetInteractiveMarkers.Request,
                response: GetInteractiveMarkers.Response) -> GetInteractiveMarkers.Response:
        response.sequence_number = self._sequence
        response.markers = self._handles.markers(self._simulation.state)
        return response


def _pose(pose: Pose) -> tuple[np.ndarray, np.ndarray]:
    """Position (3,) m and orientation (4,) of length one; four zeros stand for no rotation."""
    q = pose.orientation
    orientation = (q.x, q.y, q.z, q.w)
    errors.check_finite('pose.orientation', orientation)
    length = math.hypot(*orientation)
    straight = np.array([0.0, 0.0, 0.0, 1.0])
    return _vector('pose.position', pose.position), (
        np.array(orientation) / length if 0 < length < math.inf else straight)


def _vector(name: str, message: object) -> np.ndarray:
    values = (message.x, message.y, message.z)
    errors.check_finite(name, values)
    return np.array(values)
