"""A status line from the state and diagnostics that a node publishes."""
from __future__ import annotations

import contextlib
import math

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node
from sensor_msgs.msg import MultiDOFJointState

from ...model.scene import SECOND
from ..diagnostics import status_name
from ..messages.measures import deserialize_measures


class StatusLine:
    """Subscribes to state and diagnostics of the ragdoll node of a fully qualified ``name``."""

    def __init__(self, node: Node, name: str) -> None:
        self._status_name = status_name(*name.rsplit('/', 1))
        self._values: dict[str, str] = {}
        self.state: MultiDOFJointState | None = None
        self.time = 0.0
        """Simulated time, s."""
        self.subscriptions = [
            node.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, 10),
            node.create_subscription(MultiDOFJointState, f'{name}/state', self._on_state, 1),
            node.create_subscription(DiagnosticArray, f'{name}/measures', self._on_measures, 1,
                                     raw=True)]

    @property
    def paused(self) -> bool:
        """Whether the node is paused, by its last report."""
        return self._values.get('paused') == 'true'

    @property
    def real_time_factor(self) -> float:
        """The node's requested real-time factor, by its last report."""
        return float(self._values.get('real_time_factor', 1.0))

    def text(self, push: str = '') -> str:
        """Real-time factor, time, push, tick cost and first bone; without a push it fits 80
        columns.
        """
        if self.state is None or not self._values:
            return 'waiting for the node'
        values = self._values
        factor = 'paused' if self.paused else f'RTF {float(values["pace"]):.2f}'
        return '  '.join((factor, f'{self.time:.1f} s', f'push {push or values["push"]}',
                          f'tick {float(values["tick_cost_ms"]):.2f} ms', self._root()))

    def _root(self) -> str:
        name, velocity = self.state.joint_names[0], self.state.twist[0].linear
        position = self.state.transforms[0].translation
        speed = math.hypot(velocity.x, velocity.y, velocity.z)
        return f'{name} {position.x:.2f} {position.y:.2f} {position.z:.2f} m {speed:.1f} m/s'

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name == self._status_name:
                self._values = {pair.key: pair.value for pair in status.values}

    def _on_measures(self, data: bytes) -> None:
        with contextlib.suppress(ValueError):
            self.time = deserialize_measures(data)[1].time / SECOND

    def _on_state(self, message: MultiDOFJointState) -> None:
        self.state = message
