"""The tick timer, and rate limits for what rclpy's executor polls at each wake-up."""
from __future__ import annotations

import math
import sys
import threading
import time
from collections.abc import Callable
from typing import TypeVar

from rclpy.clock import Clock
from rclpy.node import Node

from ..realtime.pacer import Pacer

MIN_TIMER_PERIOD = 1_000_000
"""ns; for a shorter tick period the timer callback makes several ticks."""

MAX_CALLBACK_TIME = 20_000_000
"""ns that one timer callback may spend on ticks before other callbacks get their turn."""

TIMER_ROUNDING = 1_000_000
"""ns by which a timer may come before it should."""

CATCH_UP_RATE = 2
"""Largest tick rate after a stall, over the normal rate: queues are ten messages deep."""

IDLE_TICKS = 2
"""Ticks per wake-up while idle: a new subscriber or push waits one tick more at most, and no stamp
is late by more than a tick."""

BESIDE_INTERVAL = 1e-3
"""s: Python's switch interval while something runs beside the ticks: a tick waits for the
interpreter that long, a few times."""

Result = TypeVar('Result')

SERVICE_INTERVAL, QOS_EVENT_INTERVAL = 100_000_000, 1_000_000_000
"""ns between two polls of the services and of the QoS events (incompatible QoS of other nodes)."""


class PollThrottle:
    """Rate limiter: opens for ``wakes`` wake-ups per ``interval``, ns, in which entities are
    polled: two, or one after Ticker.drive().

    At each wake-up rclpy's executor goes through all waitables of a node: services and QoS events,
    37 here, cost more per tick than a sleeping doll. Two wake-ups, because that executor collects
    the entities, waits, and then handles what it had collected; a timer that is ready comes first.
    """

    def __init__(self, interval: int) -> None:
        self._interval = interval
        self.wakes = self._wakes_left = 2
        self._next = 0

    @property
    def is_open(self) -> bool:
        """Whether the entities are to be polled now."""
        return self._wakes_left > 0

    def wake(self, now: int) -> None:
        """Count a wake-up of the timer at ``now``, ns of the steady clock."""
        self._wakes_left = max(0, self._wakes_left - 1)
        if not self._wakes_left and now >= self._next:
            self._wakes_left, self._next = self.wakes, now + self._interval


class Ticker:
    """A timer on the ``steady`` clock that calls ``tick(due)`` each period, from start() to stop().

    ``due`` is the steady time, ns, at which the tick was due. After drive() an executor takes the
    timer's place.
    """

    def __init__(self, node: Node, steady: Clock, tick: Callable[[float], None]) -> None:
        self._tick = tick
        self._pacer = Pacer(1.0, 0)
        self.running = False
        """Whether there are ticks, from start() to stop()."""
        self._ticks_per_wake = 1
        self._throttles = {interval: PollThrottle(interval)
                           for interval in (SERVICE_INTERVAL, QOS_EVENT_INTERVAL)}
        self._timer = node.create_timer(1.0, self.run, clock=steady)
        self._is_timed = True

    @property
    def dropped_time(self) -> float:
        """Time, ns, that was not caught up after long stalls."""
        return self._pacer.dropped_time

    @property
    def dropped_ticks(self) -> int:
        """Number of ticks that would have been made in ``dropped_time``."""
        return round(self._pacer.dropped_ticks)

    def polls(self, interval: int) -> bool:
        """Whether to poll the entities of SERVICE_INTERVAL or QOS_EVENT_INTERVAL; true while
        stopped.
        """
        return not self.running or self._throttles[interval].is_open

    @property
    def polls_any(self) -> bool:
        """Whether entities of any interval are to be polled, as while stopped."""
        return any(map(self.polls, self._throttles))

    @property
    def wait(self) -> float:
        """Time until ticks are to be made, ns."""
        later = (self._ticks_per_wake - 1) * self._pacer.period
        return self._pacer.wait(time.monotonic_ns()) + later

    def drive(self) -> None:
        """End the timer: the caller calls run() instead, and after it polls what polls() allows."""
        self._is_timed = False
        self._timer.cancel()
        for throttle in self._throttles.values():
            throttle.wakes = 1

    def start(self, period: float) -> None:
        """Start or restart; the first tick is due one ``period``, ns, from now."""
        self._pacer.period = period
        self._pacer.start(time.monotonic_ns())
        self._set_ticks_per_wake(1)
        self._reset_timer()
        self.running = True

    def set_idle(self, idle: bool) -> None:
        """While ``idle``, wake every second tick and make two, as an rclpy wake-up costs more than
        such a tick. ``idle``: all dolls are asleep and there is no subscriber.
        """
        ticks = IDLE_TICKS if idle else 1
        if ticks != self._ticks_per_wake:
            self._set_ticks_per_wake(ticks)

    def stop(self) -> None:
        """Stop ticking."""
        self._timer.cancel()
        self.running = False

    def run_beside(self, make: Callable[[], Result]) -> Result:
        """Return what ``make`` returns, or raise what it raises. It runs in a thread; meanwhile the
        ticks go on, though the callback that called this has not returned.
        """
        results: list[Result] = []
        failures: list[BaseException] = []
        done = threading.Event()

        def run() -> None:
            try:
                results.append(make())
            except BaseException as error:  # for the thread that waits
                failures.append(error)
            finally:
                done.set()

        interval = sys.getswitchinterval()
        sys.setswitchinterval(BESIDE_INTERVAL)
        try:
            threading.Thread(target=run, name='beside ticks', daemon=True).start()
            pause = MIN_TIMER_PERIOD / 1e9
            while not done.wait(pause):
                begin = time.monotonic()
                if self.running:
                    self.run()
                # As long as the ticks took: on a busy machine they would leave nothing to it.
                pause = max(MIN_TIMER_PERIOD / 1e9, time.monotonic() - begin)
        finally:
            sys.setswitchinterval(interval)
        if failures:
            raise failures[0]
        return results[0]

    def _reset_timer(self) -> None:
        if self._is_timed:
            self._timer.reset()

    def _set_ticks_per_wake(self, ticks: int) -> None:
        self._ticks_per_wake, period = ticks, self._pacer.period
        self._timer.timer_period_ns = max(MIN_TIMER_PERIOD, round(period)) * ticks
        self._max_ticks = math.ceil(CATCH_UP_RATE * self._timer.timer_period_ns / period)

    def run(self) -> None:
        """Make the ticks that are due, within the time limit; the timer calls it."""
        woken = time.monotonic_ns()
        for throttle in self._throttles.values():
            throttle.wake(woken)
        end, dropped = woken + MAX_CALLBACK_TIME, self._pacer.dropped_time
        # A tick that is made before it is due has a stamp in the future.
        made, early = 0, min(0.5, TIMER_ROUNDING / self._pacer.period)
        while made < self._max_ticks:
            now = time.monotonic_ns()
            if now > end or not self._pacer.due(now, 0.0 if made else early):
                break
            self._tick(self._pacer.last_due)
            made += 1
        if self._pacer.dropped_time != dropped:
            # Ticks are due in another phase now. The timer would come up to half a period before
            # them, and stamps would lie in the future.
            self._reset_timer()
