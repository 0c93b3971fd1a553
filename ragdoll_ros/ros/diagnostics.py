"""How the simulation does, once a second on /diagnostics."""
from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock
from rclpy.node import Node

from ..push import Push
from ..scene import SECOND
from ..simulation import Simulation
from .tally import Tally

PERIOD = 1.0
"""s of the steady clock between two reports."""

BEHIND = 0.95
"""Share of the wanted pace below which it is told that the doll falls behind."""


class Diagnostics:
    """Collects what each tick cost; reports pace, cost, errors and counts.

    ``facts`` gives what only the node knows, as names and values; ``wanted_pace`` the pace that
    is asked for now, 0 while the doll is paused.
    """

    def __init__(self, node: Node, steady: Clock, tally: Tally, facts: Callable[[], dict],
                 wanted_pace: Callable[[], float]) -> None:
        self._node, self._steady, self._tally = node, steady, tally
        self._facts, self._wanted_pace = facts, wanted_pace
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self._told = 0
        self.simulation: Simulation
        self._begin()
        node.create_timer(PERIOD, self.report, clock=steady)

    def count(self, cost: int, simulated: int) -> None:
        """Enter a tick: ns that it took, and ns that it went on."""
        self._ticks += 1
        self._cost += cost
        self._dearest = max(self._dearest, cost)
        self._simulated += simulated

    def report(self) -> None:
        """Publish, and begin to count anew."""
        pace = self._simulated / max(1, self._steady.now().nanoseconds - self._since)
        level, message = self._judge(pace)
        values = {name: _text(value) for name, value in self._values(pace).items()}
        status = DiagnosticStatus(
            level=level, name=f'{self._node.get_name()}: simulation', message=message,
            hardware_id=self.simulation.scene.name,
            values=[KeyValue(key=key, value=value) for key, value in values.items()])
        array = DiagnosticArray(status=[status])
        array.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(array)
        self._begin()

    def _begin(self) -> None:
        self._since = self._steady.now().nanoseconds
        self._ticks = self._cost = self._dearest = self._simulated = 0

    def _judge(self, pace: float) -> tuple[bytes, str]:
        """Level and message: what was refused since the last report, else how the pace is."""
        tally, wanted = self._tally, self._wanted_pace()
        counted = tally.refused.total() + tally.clamped.total()
        news, self._told = counted > self._told, counted
        if news:
            return DiagnosticStatus.WARN, tally.reason
        if wanted and self._ticks and pace < BEHIND * wanted:
            return DiagnosticStatus.WARN, f'pace {pace:.3g} falls behind {wanted:.3g}'
        return DiagnosticStatus.OK, 'running' if wanted else 'paused'

    def _values(self, pace: float) -> dict[str, object]:
        simulation, tally = self.simulation, self._tally
        ticks = max(1, self._ticks)
        return {
            'pace': pace,
            'simulated_time': simulation.time / SECOND,
            'tick_cost_ms': self._cost / ticks / 1e6,
            'tick_cost_max_ms': self._dearest / 1e6,
            'asleep': simulation.asleep,
            'push': pushes_text(simulation.pushes),
            **self._facts(),
            **_measures(simulation),
            'refused': tally.refused.total(),
            'clamped': tally.clamped.total(),
            'last_reason': tally.reason,
            **{f'refused {source}': count for source, count in tally.refused.items()},
            **{f'clamped {source}': count for source, count in tally.clamped.items()}}


def pushes_text(pushes: Sequence[Push]) -> str:
    """Pushes in words: force, torque, bone."""
    return ', '.join(_push_text(push) for push in pushes) or 'none'


def _push_text(push: Push) -> str:
    parts = [f'({" ".join(f"{value:.4g}" for value in vector)}) {unit}'
             for vector, unit in ((push.force, 'N'), (push.torque, 'N m')) if any(vector)]
    return f'{" ".join(parts)} on {push.bone}' + (' in its own axes' if push.local else '')


def _measures(simulation: Simulation) -> dict[str, float]:
    """Error measures of the simulation: name and number."""
    measures = getattr(simulation, 'measures', None)
    return measures() if measures else {}


def _text(value: object) -> str:
    if isinstance(value, float):
        return f'{value:.6g}' if math.isfinite(value) else 'unknown'
    return str(value)
