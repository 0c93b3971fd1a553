"""The subscription that sets the state of a doll: Odometry becomes Simulation.set_state()."""
from __future__ import annotations

from collections.abc import Callable

from nav_msgs.msg import Odometry
from rclpy.node import Node

from ...model import errors, rotation
from ...model.drive import MAX_SPEED
from ...model.ragdoll import WORLD
from ...model.vectors import unit_vector
from ...physics.simulation import Simulation
from ..parameters.node_settings import NodeSettings
from .input_counts import InputCounts
from .subscriptions import limited

TOPIC = '~/set_state'


class StateSubscription:
    """Subscription to ~/set_state.

    ``pose`` is the root's in the world frame. ``twist`` is along the root's own axes, as nav_msgs
    defines it for ``child_frame_id``, the name of the doll. Covariances are ignored. ``after`` is
    called when a state has been set.
    """

    def __init__(self, node: Node, counts: InputCounts, after: Callable[[], None]) -> None:
        self._counts, self._after = counts, after
        self.simulation: Simulation
        self.settings: NodeSettings
        node.create_subscription(Odometry, TOPIC, self.on_odometry, 10)

    def on_odometry(self, message: Odometry) -> None:
        """Set pose and velocities of a doll; a message that is wrong is refused and counted."""
        try:
            self._set(message)
        except errors.ModelError as error:
            self._counts.refuse(TOPIC, error)
        else:
            self._after()

    def _set(self, message: Odometry) -> None:
        frame = message.header.frame_id
        if frame not in (WORLD, self.settings.frame_id):
            raise errors.WrongForm('header.frame_id', frame, self.settings.frame_id)
        pose, twist = message.pose.pose, message.twist.twist
        q = pose.orientation
        orientation = unit_vector('pose.orientation', (q.x, q.y, q.z, q.w),
                                  'a quaternion x, y, z, w, not zero', 4)
        velocity, spin = (
            tuple(rotation.rotate(orientation, limited(
                self._counts, TOPIC, f'twist.{name}', vector, MAX_SPEED, 'the limit')).tolist())
            for name, vector in (('linear', twist.linear), ('angular', twist.angular)))
        p = pose.position
        self.simulation.set_state(message.child_frame_id, (p.x, p.y, p.z), orientation, velocity,
                                  spin)
