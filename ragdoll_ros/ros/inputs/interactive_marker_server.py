"""Interactive marker server: bones are dragged by RViz's interactive marker protocol.

One marker per bone, with the bone's name and the pose of its centre of mass. A client (RViz, the
page) calls the service once, follows the updates, and publishes feedback:

- MOUSE_DOWN: grab the bone ``marker_name`` at ``mouse_point``, or at its centre of mass if that is
  not valid; ``pose`` is the pose of the marker that the client displayed.
- POSE_UPDATE: the client moved the marker to ``pose``; the hand moves to where the grabbed point of
  a bone at that pose would be. Ignored without a grab.
- KEEP_ALIVE: the hand stays where it is.
- MOUSE_UP: release.

``header.frame_id`` is the parameter ``frame_id`` or ``world``. A hand is identified by
``client_id`` and ``marker_name`` together, as two RViz have the same id. Several clients can drag
at once, and with different ids also one bone. The drag of a client without feedback for
CLIENT_TIMEOUT ends. Other feedback is refused and counted.

RViz Jazzy (rviz_default_plugins, interactive_markers 2.5) calls
``<namespace>/get_interactive_markers`` and expects each update's ``seq_num`` to be one more than
the last. It starts over if that is not so, or if an update has a pose of an unknown marker. It
needs no keep-alive updates. Both topics are reliable, depth 100. During a drag RViz sends a
POSE_UPDATE with every frame and ignores our poses of that marker.
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

from ...model import errors, rotation
from ...model.ragdoll import WORLD
from ...model.scene import Scene
from ...physics.actions.grab import DRAG_TIME
from ...physics.simulation import Simulation
from ..messages.interactive_markers import InteractiveMarkers
from ..outputs import MARKER_PERIOD
from ..parameters.node_settings import NodeSettings
from .input_counts import InputCounts
from .no_world import NoWorldLoaded

DEPTH = 100
"""Queue depth of both topics, that of the interactive_markers package."""

CLIENT_TIMEOUT = 3_000_000_000
"""ns of the steady clock without feedback after which a drag ends. RViz sends none while Shift is
held and the mouse rests, which should not drop the bone at once."""

FEEDBACK = '~/interactive/feedback'


@dataclass
class _Drag:
    """A client's drag: the grabbed point (3,) m, bone frame, and when feedback came last, ns."""

    point: np.ndarray
    last_feedback: int


class InteractiveMarkerServer:
    """Publishes the markers; moves hands by the feedback. ``now``: time of a steady clock, ns."""

    def __init__(self, node: Node, counts: InputCounts, now: Callable[[], int]) -> None:
        self._counts, self._now = counts, now
        self._server_id = node.get_fully_qualified_name()
        self._markers: InteractiveMarkers | None = None
        self._sequence = 0
        self._next_update = 0
        self._drags: dict[str, _Drag] = {}
        self._simulation: Simulation | None = None
        self.settings: NodeSettings
        self._updates = node.create_publisher(InteractiveMarkerUpdate, '~/interactive/update',
                                              DEPTH)
        node.create_subscription(InteractiveMarkerFeedback, FEEDBACK, self.on_feedback, DEPTH)
        node.create_service(GetInteractiveMarkers, '~/interactive/get_interactive_markers',
                            self._get_markers)

    def prepare(self, scene: Scene, frame: str) -> InteractiveMarkers:
        """Markers of a scene; this may run beside the ticks."""
        markers = InteractiveMarkers(scene, frame, self._server_id)
        if self._updates.get_subscription_count():
            markers.make_template()
        return markers

    def set_simulation(self, simulation: Simulation, settings: NodeSettings,
                       markers: InteractiveMarkers) -> None:
        """Publish the markers of this simulation and erase those whose bones are gone. Of the same
        simulation and frame, only markers of new bones are published. A new simulation ends all
        drags.
        """
        last = frozenset() if self._markers is None else self._markers.names
        known = last if simulation is self._simulation and (
            settings.frame_id == self.settings.frame_id) else frozenset()
        if simulation is not self._simulation:
            self._drags.clear()
        self._simulation, self.settings, self._markers = simulation, settings, markers
        self._sequence += 1
        if self._updates.get_subscription_count():
            self._updates.publish(markers.make_update(
                self._sequence, markers=markers.at(simulation.state, markers.names - known),
                erases=sorted(last - markers.names)))

    def unload(self) -> None:
        """Erase all markers: there is no world."""
        self._drags.clear()
        self._sequence += 1
        if self._markers is not None and self._updates.get_subscription_count():
            self._updates.publish(self._markers.make_update(
                self._sequence, erases=sorted(self._markers.names)))
        self._markers = self._simulation = None

    def publish(self, now: int, paused: bool = False) -> None:
        """Publish the poses at ``now``, ns, and end the drags of clients that are gone.

        ``paused``: ignore the rate limit, as no later publication may follow.
        """
        for hand, drag in list(self._drags.items()):
            if now - drag.last_feedback > CLIENT_TIMEOUT:
                self._release(hand)
        if paused or now >= self._next_update:
            self._next_update = now + MARKER_PERIOD
            self.publish_poses()

    def publish_poses(self) -> None:
        """Publish the poses of the markers now, if there is a subscriber."""
        if self._updates.get_subscription_count():
            self._sequence += 1
            self._updates.publish(self._markers.serialize_update(self._sequence,
                                                                 self._simulation.state))

    def on_feedback(self, message: InteractiveMarkerFeedback) -> None:
        """Move a hand as the feedback asks; see the list in the docstring of the module."""
        with self._counts.refusing(FEEDBACK):
            self._apply(message)

    def _apply(self, message: InteractiveMarkerFeedback) -> None:
        self._check(message)
        position, orientation = _pose(message.pose)
        hand = f'{message.client_id} {message.marker_name}'
        kind, drag = message.event_type, self._drags.get(hand)
        if kind == message.MOUSE_DOWN:
            self._grab(hand, message, position, orientation)
        elif kind == message.MOUSE_UP:
            self._release(hand)
        elif drag is not None:
            drag.last_feedback = self._now()
            if kind == message.POSE_UPDATE:
                self._simulation.drag(hand, position + rotation.rotate(orientation, drag.point),
                                      DRAG_TIME * self.settings.real_time_factor)

    def _check(self, message: InteractiveMarkerFeedback) -> None:
        """Raise a ModelError for an unknown marker, frame or event, or without a world."""
        if self._markers is None:
            raise NoWorldLoaded
        frame = message.header.frame_id
        if message.marker_name not in self._markers.names:
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
        """Grab a bone; a point outside its bounding box is moved onto it.

        The point is relative to the pose that the client displayed: the bone may have moved since.
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

    def _release(self, hand: str) -> None:
        self._simulation.let_go(hand)
        self._drags.pop(hand, None)

    def _get_markers(self, _: GetInteractiveMarkers.Request,
                     response: GetInteractiveMarkers.Response) -> GetInteractiveMarkers.Response:
        response.sequence_number = self._sequence
        if self._markers is not None:
            response.markers = self._markers.at(self._simulation.state)
        return response


def _pose(pose: Pose) -> tuple[np.ndarray, np.ndarray]:
    """Position (3,) m and unit quaternion (4,) xyzw; four zeros are the identity."""
    q = pose.orientation
    orientation = (q.x, q.y, q.z, q.w)
    errors.check_finite('pose.orientation', orientation)
    length = math.hypot(*orientation)
    identity = np.array([0.0, 0.0, 0.0, 1.0])
    return _vector('pose.position', pose.position), (
        np.array(orientation) / length if 0 < length < math.inf else identity)


def _vector(name: str, message: object) -> np.ndarray:
    values = (message.x, message.y, message.z)
    errors.check_finite(name, values)
    return np.array(values)
