"""States of dolls that the page sets."""
from __future__ import annotations

from geometry_msgs.msg import Point, Pose, PoseWithCovariance, Twist, TwistWithCovariance
from nav_msgs.msg import Odometry
from rclpy.node import Node
from std_msgs.msg import Header

from ....model.vectors import Vector
from ....ros.messages.convert import to_vector


class StatePublisher:
    """Publishes ``~/set_state`` of the node ``name``."""

    def __init__(self, node: Node, name: str) -> None:
        self._publisher = node.create_publisher(Odometry, f'{name}/set_state', 10)

    def send(self, frame: str, doll: str, position: Vector, velocity: Vector) -> None:
        """Set the pose and velocity of a doll's root: ``position`` (3,) m and ``velocity`` (3,) m/s
        in the world frame ``frame``, and the axes of this frame.
        """
        x, y, z = position
        self._publisher.publish(Odometry(
            header=Header(frame_id=frame), child_frame_id=doll,
            pose=PoseWithCovariance(pose=Pose(position=Point(x=x, y=y, z=z))),
            twist=TwistWithCovariance(twist=Twist(linear=to_vector(velocity)))))
