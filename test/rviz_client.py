"""What RViz Jazzy's InteractiveMarkers display does, by interactive_markers' C++ client 2.5.

Service first, then updates in sequence; a gap, or a pose of an unknown marker, begins anew.
"""
from __future__ import annotations

import math

from geometry_msgs.msg import Point, Pose
from rclpy.qos import QoSProfile
from visualization_msgs.msg import InteractiveMarkerFeedback as Feedback
from visualization_msgs.msg import InteractiveMarkerUpdate
from visualization_msgs.srv import GetInteractiveMarkers

QOS = QoSProfile(depth=100)
"""rclcpp::QoS(100): reliable, volatile."""


class RvizClient:
    """A display in RViz whose fixed frame is ``world``, and a mouse on it."""

    def __init__(self, peer, namespace='/ragdoll/interactive', client_id='/rviz'):
        self.markers = {}
        self.resets = 0
        self.seen = []
        self.dragged = None
        self._peer, self.client_id = peer, client_id
        self._service = peer.create_client(GetInteractiveMarkers,
                                           f'{namespace}/get_interactive_markers')
        self._publisher = peer.create_publisher(Feedback, f'{namespace}/feedback', QOS)
        peer.create_subscription(InteractiveMarkerUpdate, f'{namespace}/update', self._take, QOS)
        self._begin()

    def start(self):
        """Wait until the server is there and all markers are known."""
        self._peer.wait(lambda: self._service.service_is_ready()
                        and self._publisher.get_subscription_count())
        future = self._service.call_async(GetInteractiveMarkers.Request())
        self._peer.wait(future.done)
        answer = future.result()
        self._waiting = [update for update in self._waiting
                         if update.seq_num > answer.sequence_number]
        self.markers = {marker.name: marker for marker in answer.markers}
        self._running = True
        waiting, self._waiting = self._waiting, []
        for update in waiting:
            self._show(update)
        return answer

    def press(self, name, point=None):
        """Mouse down on a marker; RViz sends its pose first, and holds it from then on."""
        self.dragged = name
        self._from = self.markers[name].pose
        self._grip = point
        self._send(name, Feedback.POSE_UPDATE, self._from, point)
        self._send(name, Feedback.MOUSE_DOWN, self._from, point)

    def move(self, x, y, z):
        """Mouse dragged so that the marker is shown elsewhere, its orientation kept."""
        pose = Pose(position=Point(x=x, y=y, z=z), orientation=self._from.orientation)
        self._from = pose
        self._send(self.dragged, Feedback.POSE_UPDATE, pose)

    def release(self):
        """Mouse up; the marker goes to where the server says that it is."""
        self._send(self.dragged, Feedback.POSE_UPDATE, self._from)
        self._send(self.dragged, Feedback.MOUSE_UP, self._from)
        self.dragged = None

    def send(self, **fields):
        """Feedback of any kind."""
        self._publisher.publish(Feedback(client_id=self.client_id, **fields))

    def _send(self, name, kind, pose, point=None):
        message = Feedback(client_id=self.client_id, marker_name=name, control_name='drag',
                           event_type=kind, pose=pose, mouse_point_valid=point is not None)
        message.header = self.markers[name].header
        if point is not None:
            message.mouse_point = Point(x=point[0], y=point[1], z=point[2])
        self._publisher.publish(message)

    def _begin(self):
        self._last = None
        self._running = False
        self._waiting = []

    def _take(self, update):
        assert update.type == update.UPDATE, 'keep-alives are no longer expected'
        self.seen.append(update)
        if self._last is not None and update.seq_num != self._last + 1:
            self.resets += 1
            self._begin()
            return
        self._last = update.seq_num
        if self._running:
            self._show(update)
        else:
            self._waiting.append(update)

    def _show(self, update):
        """Markers, poses, erasures, in this order, as the display does."""
        for marker in update.markers:
            self.markers[marker.name] = marker
        for pose in update.poses:
            assert all(map(math.isfinite, (pose.pose.position.x, pose.pose.orientation.w)))
            if pose.name not in self.markers:
                self.resets += 1
                self._begin()
                return
            if pose.name != self.dragged:
                self.markers[pose.name].pose = pose.pose
        for name in update.erases:
            self.markers.pop(name, None)
