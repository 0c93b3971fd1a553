"""Pacer: when ticks are due on a steady clock."""
from __future__ import annotations

MAX_LAG = 500_000_000
"""ns of the steady clock that are caught up after a stall; a longer lag is dropped."""

MAX_CATCH_UP = 1_000_000_000
"""ns for which ticks may be late one after the other; after that they count as too expensive."""


class Pacer:
    """Schedules ticks of a fixed ``period``: catches up short stalls, drops long ones.

    A tick is accepted half a period early, so that timer jitter neither skips nor doubles one.
    When ticks take longer than the period, each is due at once until one is on time again: the
    real-time factor falls and no lag accumulates. All times are ns of one steady clock.
    """

    def __init__(self, period: float, now: int) -> None:
        self.period = period
        self.dropped_time = 0.0
        """ns that were not caught up so far."""
        self.dropped_ticks = 0.0
        """Ticks that would have been made in that time."""
        self.start(now)

    def start(self, now: int) -> None:
        """Restart: the next tick is due one period from now, and nothing is caught up."""
        self.last_due = float(now)
        """When the last tick was due."""
        self._next = now + self.period
        self._on_time = now

    def wait(self, now: int) -> float:
        """Time until the next tick, ns; 0 if it is late."""
        if now <= self._next:
            self._on_time = now
        return max(0.0, self._next - now)

    def due(self, now: int, early: float = 0.5) -> bool:
        """Whether a tick is due; if so, it counts as made. ``early``: fraction of the period by
        which a tick may be made before it is due.
        """
        lag = now - self._next
        if lag <= 0:
            self._on_time = now
        if lag < -self.period * early:
            return False
        overloaded = now - self._on_time > max(MAX_CATCH_UP, 2 * self.period)
        if overloaded or lag > max(MAX_LAG, self.period):
            self.dropped_time += lag
            self.dropped_ticks += lag / self.period
            self._next = float(now)
        self.last_due = self._next
        self._next += self.period
        return True
