"""Pace: when the next tick is due on a steady clock."""
from __future__ import annotations

MOST_LAG = 500_000_000
"""ns of the steady clock that may be caught up after a stall; what is more is given up."""


class Pacer:
    """Ticks at a steady rate, caught up after a short stall, given up after a long one.

    A tick counts as due half a period early, so that a timer that fires a little before or
    after its time makes neither none nor two of it. All times are ns of one steady clock.
    """

    def __init__(self, period: float, now: int) -> None:
        self.period = period
        self.lost = 0.0
        """ns that were given up since the start."""
        self.start(now)

    def start(self, now: int) -> None:
        """Begin anew: the next tick is due one period from now, and nothing is caught up."""
        self._next = now + self.period

    def wait(self, now: int) -> float:
        """The ns until the next tick; 0 if it is late."""
        return max(0.0, self._next - now)

    def due(self, now: int) -> bool:
        """Whether a tick is due; if so, it counts as done."""
        lag = now - self._next
        if lag < -self.period / 2:
            return False
        if lag > max(MOST_LAG, self.period):
            self.lost += lag
            self._next = float(now)
        self._next += self.period
        return True
