"""The subscription to cmd_vel, as Twist or TwistStamped, and what publishes the other type."""
from __future__ import annotations

from collections.abc import Callable

from geometry_msgs.msg import Twist, TwistStamped
from rclpy.node import Node
from rclpy.subscription import Subscription

TOPIC = 'cmd_vel'


class CmdVelSubscription:
    """Subscribes ``on_twist`` or, once stamped is requested, ``on_stamped`` to cmd_vel.

    DDS connects equal types only: a publisher of the other one is not heard, and nothing says so.
    """

    def __init__(self, node: Node, on_twist: Callable[[Twist], None],
                 on_stamped: Callable[[TwistStamped], None]) -> None:
        self._node = node
        self._callbacks = {False: (Twist, on_twist), True: (TwistStamped, on_stamped)}
        self._stamped: bool | None = None
        self.subscription: Subscription | None = None
        self.unheard = ''
        """Warning about publishers of the other type, at the last check; empty: none."""

    def subscribe(self, stamped: bool) -> None:
        """Subscribe to this type, if that is not so yet."""
        if stamped != self._stamped:
            self._stamped = stamped
            if self.subscription is not None:
                self._node.destroy_subscription(self.subscription)
            kind, callback = self._callbacks[stamped]
            self.subscription = self._node.create_subscription(kind, TOPIC, callback, 10)

    def check_publishers(self) -> None:
        """Look for publishers of the other type, and warn of new ones; to be called by a timer."""
        wanted, other = (_type_name(self._callbacks[stamped][0])
                         for stamped in (self._stamped, not self._stamped))
        names = sorted({f'{found.node_namespace.rstrip("/")}/{found.node_name}'
                        for found in self._node.get_publishers_info_by_topic(TOPIC)
                        if found.topic_type == other})
        before, self.unheard = self.unheard, ''
        if names:
            self.unheard = (
                f'{", ".join(names)} publishes {other} on {self.subscription.topic_name}, which is '
                f'not heard: this node takes {wanted}; set the parameter stamped_cmd_vel to '
                f'{str(not self._stamped).lower()}')
        if self.unheard not in ('', before):
            self._node.get_logger().warning(self.unheard)


def _type_name(kind: type) -> str:
    return f'geometry_msgs/msg/{kind.__name__}'
