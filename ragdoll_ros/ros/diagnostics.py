"""How the simulation does: on /diagnostics once a second, and at once when its time is handled."""
from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock
from rclpy.node import Node

from ..model.push import Push
from ..model.scene import SECOND
from .input_counts import Tally
from .messages.convert import to_time

if TYPE_CHECKING:  # else the page and the teleop, which read this file, would load an engine
    from ..physics.simulation import Simulation

PERIOD = 1.0
"""s of the steady clock between two reports."""

BEHIND = 0.95
"""Share of the wanted pace below which a report warns that the doll falls behind."""


class Diagnostics:
    """Collects what each tick cost; reports pace, cost, errors and counts.

    ``facts()``: what only the node knows, by name; ``wanted_pace()``: simulated s asked for in each
    s on the wall, 0 while paused; ``stamp()``: ns that a report is to bear.
    """

    def __init__(self, node: Node, steady: Clock, tally: Tally, facts: Callable[[], dict],
                 wanted_pace: Callable[[], float], stamp: Callable[[], int]) -> None:
        self._node, self._steady, self._tally = node, steady, tally
        self._facts, self._wanted_pace, self._stamp = facts, wanted_pace, stamp
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self._counted = self._dropped = self._bad = 0
        self._last: dict[str, float] | None = None
        self.simulation: Simulation
        self.begin()
        node.create_timer(PERIOD, self._close, clock=steady)

    def count(self, cost: int, late: float, simulated: int) -> None:
        """Enter a tick, all in ns: what it took on the wall, how long after it was due it began,
        and what it simulated.
        """
        self._ticks += 1
        self._cost += cost
        self._dearest = max(self._dearest, cost)
        self._late += late
        self._latest = max(self._latest, late)
        self._simulated += simulated

    def report(self) -> None:
        """Tell who listens how it is now; pace and cost are those of the last whole period."""
        if self._last is None or not self._publisher.get_subscription_count():
            return
        level, message = self._judge()
        status = DiagnosticStatus(
            level=level, name=status_name(self._node.get_namespace(), self._node.get_name()),
            message=message, hardware_id=self.simulation.scene.name,
            values=[KeyValue(key=key, value=_text(value)) for key, value in self._values().items()])
        array = DiagnosticArray(status=[status])
        array.header.stamp = to_time(self._stamp())
        self._publisher.publish(array)

    def _close(self) -> None:
        """Close a period: report it, and begin to count anew."""
        elapsed = max(1, self._steady.now().nanoseconds - self._since)
        # In ms; what the process takes besides ticks is little, and to ask at each tick is not.
        spent, ticks = time.process_time_ns() - self._spent, 1e6 * max(1, self._ticks)
        self._last = {'pace': self._simulated / elapsed,
                      'tick_cost_ms': self._cost / ticks, 'tick_cost_max_ms': self._dearest / 1e6,
                      'tick_cpu_ms': spent / ticks,
                      'stamp_lag_ms': self._late / ticks, 'stamp_lag_max_ms': self._latest / 1e6}
        self.report()
        self.begin()

    def begin(self) -> None:
        """Begin to count anew, as after a change of the pace: a mean over both tells nothing."""
        self._since = self._steady.now().nanoseconds
        self._spent = time.process_time_ns()
        self._ticks = self._cost = self._dearest = self._simulated = 0
        self._late = self._latest = 0.0

    def _judge(self) -> tuple[bytes, str]:
        """Level and message: what was bad, refused or late since the last report, else OK."""
        tally, wanted = self._tally, self._wanted_pace()
        counted = tally.refused.total() + tally.clamped.total()
        refused, self._counted = counted > self._counted, counted
        warnings = [tally.reason] if refused else []
        facts = self._facts()
        if facts['namesakes']:
            warnings.append(f'{facts["namesakes"] + 1} nodes have this name')
        warnings += self._stalls(wanted, facts)
        bad, self._bad = facts['bad_states'] - self._bad, facts['bad_states']
        if bad:
            dump = facts['state_dump'] and f'; the states before are in {facts["state_dump"]}'
            return DiagnosticStatus.ERROR, '; '.join(
                [f'{bad} bad states were not published: {facts["bad_state"]}{dump}', *warnings])
        if warnings:
            return DiagnosticStatus.WARN, '; '.join(warnings)
        return DiagnosticStatus.OK, 'running' if wanted else 'paused'

    def _stalls(self, wanted: float, facts: dict) -> list[str]:
        """What fell behind the clock on the wall; late by more than a tick on the average counts,
        as a busy machine lets one tick or another wait.
        """
        last, found = self._last, []
        if wanted and self._ticks and last['pace'] < BEHIND * wanted:
            found.append(f'pace {last["pace"]:.3g} falls behind {wanted:.3g}')
        dropped, self._dropped = facts['dropped_ticks'] - self._dropped, facts['dropped_ticks']
        if dropped:
            found.append(f'{dropped} ticks were dropped')
        if wanted and last['stamp_lag_ms'] > self.simulation.tick / wanted / 1e6:
            found.append(f'stamps were {last["stamp_lag_ms"]:.3g} ms late')
        return found

    def _values(self) -> dict[str, object]:
        simulation, tally = self.simulation, self._tally
        return {
            **self._last,
            'engine': simulation.engine_name,
            'engine_reason': simulation.engine_reason,
            'simulated_time': simulation.time / SECOND,
            'push': pushes_text(simulation.pushes),
            **self._facts(),
            **simulation.measures(),
            'refused': tally.refused.total(),
            'clamped': tally.clamped.total(),
            'last_reason': tally.reason,
            **{f'refused {source}': count for source, count in tally.refused.items()},
            **{f'clamped {source}': count for source, count in tally.clamped.items()}}


def status_name(namespace: str, node: str) -> str:
    """Name of a node's status: /diagnostics is one topic for all."""
    return f'{namespace}/{node}: simulation'.lstrip('/')


def pushes_text(pushes: Sequence[Push]) -> str:
    """Pushes in words: force, torque, bone."""
    return ', '.join(_push_text(push) for push in pushes) or 'none'


def _push_text(push: Push) -> str:
    parts = [f'({" ".join(f"{value:.4g}" for value in vector)}) {unit}'
             for vector, unit in ((push.force, 'N'), (push.torque, 'N m')) if any(vector)]
    return f'{" ".join(parts)} on {push.bone}' + (' in its own axes' if push.local else '')


def _text(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f'{value:.6g}' if math.isfinite(value) else 'unknown'
    return str(value)
