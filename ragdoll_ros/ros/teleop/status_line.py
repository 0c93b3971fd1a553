"""One line that says how the doll does, from what the node publishes."""
from __future__ import annotations

import math

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node
from sensor_msgs.msg import MultiDOFJointState

from ...model.scene import SECOND
from ..diagnostics import status_name


class Status:
    """Listens to the state and diagnostics of the ragdoll node of a full ``name``."""

    def __init__(self, node: Node, name: str) -> None:
        self._name = status_name(*name.rsplit('/', 1))
        self._values: dict[str, str] = {}
        self._state: MultiDOFJointState | None = None
        self.subscriptions = [
            node.create_subscription(DiagnosticArray, '/diagnostics', self._take_diagnostics, 10),
            node.create_subscription(MultiDOFJointState, f'{name}/state', self._take_state, 1)]

    @property
    def paused(self) -> bool:
        """Whether the node said last that it is paused."""
        return self._values.get('paused') == 'true'

    @property
    def pace(self) -> float:
        """Simulated s for each s on the wall that the node is to make, as it said last."""
        return float(self._values.get('real_time_factor', 1.0))

    def line(self, push: str = '') -> str:
        """Pace, simulated time, the push that acts, tick cost, the root's place and speed.

        A line fits 80 columns while no push acts, and with one most of it.
        """
        if self._state is None or not self._values:
            return 'waiting for the node'
        values = self._values
        pace = 'paused' if self.paused else f'pace {float(values["pace"]):.2f}'
        return '  '.join((pace, f'{self._time():.1f} s', f'push {push or values["push"]}',
                          f'tick {float(values["tick_cost_ms"]):.2f} ms', self._root()))

    def _time(self) -> float:
        """Simulated time, s: stamps count from that of time zero, at their own pace."""
        stamp, values = self._state.header.stamp, self._values
        since = stamp.sec * SECOND + stamp.nanosec - int(values['stamp_of_zero'])
        return since / SECOND * float(values['stamp_pace'])

    def _root(self) -> str:
        name, place, motion = (self._state.joint_names[0], self._state.transforms[0].translation,
                               self._state.twist[0].linear)
        speed = math.hypot(motion.x, motion.y, motion.z)
        return f'{name} {place.x:.2f} {place.y:.2f} {place.z:.2f} m {speed:.1f} m/s'

    def _take_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name == self._name:
                self._values = {pair.key: pair.value for pair in status.values}

    def _take_state(self, message: MultiDOFJointState) -> None:
        self._state = message
