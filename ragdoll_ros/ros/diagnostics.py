"""The status on /diagnostics: once a second, and at once on a pause, reset or new scene."""
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
from ..physics.engine.capabilities import Capability
from .inputs.input_counts import InputCounts
from .inputs.no_world import NO_WORLD
from .messages.convert import to_time

if TYPE_CHECKING:  # else the page and the teleop, which import this file, would load an engine
    from ..physics.simulation import Simulation
    from .inputs.bodies.body_subscriptions import BodySubscriptions

PERIOD = 1.0
"""s of the steady clock between two reports."""

MIN_SPEED_RATIO = 0.95
"""Real-time factor, relative to the requested one, below which a report warns."""

MOST_STALE = 3
"""Names of driven bodies in a warning."""

MOST_OVERLAPS = 4
"""Of several initial overlaps these many are named."""


class Diagnostics:
    """Measures the cost of ticks; reports real-time factor, cost, error measures and counters.

    ``node_values()``: values of the node to report, by key; ``stamp()``: stamp of a report, ns;
    ``bodies``: the subscriptions for driven bodies, whose silence a report warns of.
    """

    def __init__(self, node: Node, steady: Clock, counts: InputCounts,
                 node_values: Callable[[], dict], stamp: Callable[[], int],
                 bodies: BodySubscriptions) -> None:
        self._node, self._steady, self._counts = node, steady, counts
        self._bodies = bodies
        self._node_values, self._stamp = node_values, stamp
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self._last_counted = self._last_dropped = self._last_bad = 0
        self._last: dict[str, float] | None = None
        self.simulation: Simulation | None = None
        """None: there is no world."""
        self.restart()
        node.create_timer(PERIOD, self._on_timer, clock=steady)

    def record_tick(self, cost: int, lag: float, simulated: int) -> None:
        """Record a tick. All in ns: ``cost``, the wall time spent; ``lag`` of the start behind its
        due time; ``simulated``, the simulated time.
        """
        self._ticks += 1
        self._cost += cost
        self._max_cost = max(self._max_cost, cost)
        self._lag += lag
        self._max_lag = max(self._max_lag, lag)
        self._simulated += simulated

    def publish(self) -> None:
        """Publish a report if there is a subscriber and a first period has ended; rates are those
        of the last full period.
        """
        if self._last is None or not self._publisher.get_subscription_count():
            return
        level, message = self._level_and_message()
        status = DiagnosticStatus(
            level=level, name=status_name(self._node.get_namespace(), self._node.get_name()),
            message=message,
            hardware_id=self.simulation.scene.name if self.simulation is not None else '',
            values=[KeyValue(key=key, value=_text(value)) for key, value in self._values().items()])
        array = DiagnosticArray(status=[status])
        array.header.stamp = to_time(self._stamp())
        self._publisher.publish(array)

    def _on_timer(self) -> None:
        """End a period and report it."""
        elapsed = max(1, self._steady.now().nanoseconds - self._since)
        # tick_cpu_ms is the whole process's: little besides ticks, and cheaper than a read a tick.
        spent, ticks = time.process_time_ns() - self._cpu_since, 1e6 * max(1, self._ticks)
        self._last = {'pace': self._simulated / elapsed,
                      'tick_cost_ms': self._cost / ticks, 'tick_cost_max_ms': self._max_cost / 1e6,
                      'tick_cpu_ms': spent / ticks,
                      'stamp_lag_ms': self._lag / ticks, 'stamp_lag_max_ms': self._max_lag / 1e6}
        self.publish()
        self.restart()

    def restart(self) -> None:
        """Restart the period, as after a change of the real-time factor."""
        self._since = self._steady.now().nanoseconds
        self._cpu_since = time.process_time_ns()
        self._ticks = self._cost = self._max_cost = self._simulated = 0
        self._lag = self._max_lag = 0.0

    def _level_and_message(self) -> tuple[bytes, str]:
        """Return the level and its message. ERROR: bad states since the last report. WARN: refused
        or clamped input since then, lag, other nodes of this name, an unheard publisher on cmd_vel,
        or driven bodies that nothing moves. Else OK.
        """
        counts, values = self._counts, self._node_values()
        requested = 0.0 if values['paused'] else values['real_time_factor']
        counted = counts.refused.total() + counts.clamped.total()
        refused, self._last_counted = counted > self._last_counted, counted
        warnings = [counts.last_reason] if refused else []
        if values['namesakes']:
            warnings.append(f'{values["namesakes"] + 1} nodes have this name')
        warnings += filter(None, [values['unheard_cmd_vel']])
        warnings += self._lag_warnings(requested, values)
        if requested and (stale := self._bodies.silent):
            warnings += [f'nothing moves {name}: {", ".join(self._bodies.topics(name))} are silent'
                         for name in stale[:MOST_STALE]]
            if len(stale) > MOST_STALE:
                warnings.append(f'nor {len(stale) - MOST_STALE} other bodies')
        bad, self._last_bad = values['bad_states'] - self._last_bad, values['bad_states']
        if bad:
            dump = values['state_dump'] and f'; the states before are in {values["state_dump"]}'
            return DiagnosticStatus.ERROR, '; '.join(
                [f'{bad} bad states were not published: {values["bad_state"]}{dump}', *warnings])
        if warnings:
            return DiagnosticStatus.WARN, '; '.join(warnings)
        if self.simulation is None:
            return DiagnosticStatus.OK, NO_WORLD
        return DiagnosticStatus.OK, 'running' if requested else 'paused'

    def _lag_warnings(self, requested: float, values: dict) -> list[str]:
        """Warnings about the real-time factor, dropped ticks, and a mean lag of over one tick."""
        last, found = self._last, []
        if requested and self._ticks and last['pace'] < MIN_SPEED_RATIO * requested:
            found.append(f'real-time factor {last["pace"]:.3g} is below the requested '
                         f'{requested:.3g}')
        dropped = values['dropped_ticks'] - self._last_dropped
        self._last_dropped = values['dropped_ticks']
        if dropped:
            found.append(f'{dropped} ticks were dropped')
        if requested and last['stamp_lag_ms'] > self.simulation.tick / requested / 1e6:
            found.append(f'stamps were {last["stamp_lag_ms"]:.3g} ms late')
        return found

    def _values(self) -> dict[str, object]:
        simulation, counts = self.simulation, self._counts
        return {
            **self._last,
            **({} if simulation is None else {
                'engine': simulation.engine_name,
                'engine_reason': simulation.engine_reason,
                'simulated_time': simulation.time / SECOND,
                'initial_overlaps': overlaps_text(simulation),
                'push': pushes_text(simulation.pushes)}),
            **self._node_values(),
            **({} if simulation is None else simulation.measures()),
            'refused': counts.refused.total(),
            'clamped': counts.clamped.total(),
            'last_reason': counts.last_reason,
            'last_reason_age': counts.last_reason_age,
            **{f'refused {source}': count for source, count in counts.refused.items()},
            **{f'clamped {source}': count for source, count in counts.clamped.items()}}


class DuplicateNodes:
    """Counts other nodes with the name and namespace of ``node``, and warns of new ones: their
    messages mix with this node's, and ROS does not report it.

    A node is known by its service ~/get_parameters. The list of node names is not used, as a node
    that has ended may stay in it: rmw_dds_common's GraphCache adds a participant with each message
    of its entities, also with one that is read after the participant has gone.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self.count = 0

    def update(self) -> None:
        """Count the nodes in the graph; to be called by a timer."""
        node = self._node
        own = f'{node.get_fully_qualified_name()}/get_parameters'
        before, self.count = self.count, max(0, node.count_services(own) - 1)
        if self.count > before:
            node.get_logger().warning(
                f'{self.count + 1} nodes are called {node.get_fully_qualified_name()}: their '
                'messages mix; end all but one, or start each in its own namespace: '
                '--ros-args -r __ns:=/other')


def status_name(namespace: str, node: str) -> str:
    """Name of a node's status in /diagnostics, with its namespace, as the topic is global."""
    return f'{namespace}/{node}: simulation'.lstrip('/')


def pushes_text(pushes: Sequence[Push]) -> str:
    """Force, torque and bone of each push."""
    return ', '.join(_push_text(push) for push in pushes) or 'none'


def overlaps_text(simulation: Simulation) -> str:
    """Return the deepest initial overlaps as text: 'none' if there are none, 'unknown' if the
    engine does not find them.
    """
    if Capability.OVERLAPS not in simulation.capabilities:
        return 'unknown'
    found = simulation.initial_overlaps
    more = len(found) - MOST_OVERLAPS
    return ', '.join([*map(str, found[:MOST_OVERLAPS]),
                      *([f'and {more} more'] if more > 0 else [])]) or 'none'


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
