"""Ticks by the clock on the wall."""
from __future__ import annotations

import math
import time
from collections.abc import Callable

from rclpy.clock import Clock
from rclpy.node import Node

from ..realtime.pacer import Pacer
from .glance import Glance

SHORTEST_PERIOD = 1_000_000
"""ns between two calls of the timer at the least; at a faster pace, it makes several ticks."""

LONGEST_BURST = 20_000_000
"""ns that the timer may make ticks for before others have their turn."""

CATCH_UP = 2
"""Times the wanted pace at which a stall is caught up: listeners' queues are ten messages long."""

DOZING = 2
"""Ticks at once while none matters: who comes to listen, and what pushes, waits for one more at the
most, and no stamp is late by more than a tick."""

CALLS, MISFITS = 100_000_000, 1_000_000_000
"""ns for which the call of a service may wait while ticks follow each other closely, and the
warning that another's topic does not fit."""


class Ticker:
    """A timer of the ``steady`` clock that calls ``tick`` each period, from start() to stop().

    ``tick`` gets the steady time, ns, at which it is due.
    """

    def __init__(self, node: Node, steady: Clock, tick: Callable[[float], None]) -> None:
        self._tick = tick
        self._pacer, self._runs = Pacer(1.0, 0), False
        self._glances = {patience: Glance(patience) for patience in (CALLS, MISFITS)}
        self._timer = node.create_timer(1.0, self._catch_up, clock=steady)

    @property
    def lost(self) -> float:
        """Time that was given up in long stalls, ns."""
        return self._pacer.lost

    @property
    def dropped(self) -> int:
        """Ticks that were given up with it."""
        return round(self._pacer.dropped)

    def looks(self, patience: int) -> bool:
        """Whether what may wait for ``patience``, CALLS or MISFITS, is to be looked at now."""
        return not self._runs or self._glances[patience].is_open

    def start(self, period: float) -> None:
        """Begin anew: the first tick comes one ``period``, ns, from now."""
        self._pacer.period = period
        self._pacer.start(time.monotonic_ns())
        self._wake_for(1)
        self._timer.reset()
        self._runs = True

    def doze(self, wanted: bool) -> None:
        """Wake for every second tick, to make two then, or for each: to wake costs rclpy more than
        a tick costs that nobody hears, of dolls that sleep.
        """
        ticks = DOZING if wanted else 1
        if ticks != self._at_once:
            self._wake_for(ticks)

    def stop(self) -> None:
        """No tick from now on."""
        self._timer.cancel()
        self._runs = False

    def _wake_for(self, ticks: int) -> None:
        """Have the timer wake once for so many ticks."""
        self._at_once, period = ticks, self._pacer.period
        self._timer.timer_period_ns = max(SHORTEST_PERIOD, round(period)) * ticks
        self._most_ticks = math.ceil(CATCH_UP * self._timer.timer_period_ns / period)

    def _catch_up(self) -> None:
        """Make the ticks that are due, as far as there is time."""
        woken = time.monotonic_ns()
        for glance in self._glances.values():
            glance.wake(woken)
        end = woken + LONGEST_BURST
        for _ in range(self._most_ticks):
            now = time.monotonic_ns()
            if now > end or not self._pacer.due(now):
                break
            self._tick(self._pacer.at)
