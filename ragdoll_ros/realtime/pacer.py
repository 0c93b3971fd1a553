"""Pace: when the next tick is due on a steady clock."""
from __future__ import annotations

MOST_LAG = 500_000_000
"""ns of the steady clock that may be caught up after a stall; what is more is given up."""

LONGEST_CATCH_UP = 1_000_000_000
"""ns for which ticks may follow each other late; after that they are too dear for the pace."""


class Pacer:
    """Ticks at a steady rate, caught up after a short stall, given up after a long one.

    A tick counts as due half a period early, so that a timer that fires a little before or
    after its time makes neither none nor two of it. Where ticks are too dear for the pace, each is
    due when its turn comes, until one is on time again: the pace falls and nothing is owed. All
    times are ns of one steady clock.
    """

    def __init__(self, period: float, now: int) -> None:
        self.period = period
        self.lost = 0.0
        """ns that were given up since the start."""
        self.dropped = 0.0
        """Ticks that would have been made in that time."""
        self.start(now)

    def start(self, now: int) -> None:
        """Begin anew: the next tick is due one period from now, and nothing is caught up."""
        self.at = float(now)
        """When the last tick was due."""
        self._next = now + self.period
        self._on_time = now

    def wait(self, now: int) -> float:
        """The ns until the next tick; 0 if it is late."""
        if now <= self._next:
            self._on_time = now
        return max(0.0, self._next - now)

    def due(self, now: int) -> bool:
        """Whether a tick is due; if so, it counts as done."""
        lag = now - self._next
        if lag <= 0:
            self._on_time = now
        if lag < -self.period / 2:
            return False
        too_dear = now - self._on_time > max(LONGEST_CATCH_UP, 2 * self.period)
        if too_dear or lag > max(MOST_LAG, self.period):
            self.lost += lag
            self.dropped += lag / self.period
            self._next = float(now)
        self.at = self._next
        self._next += self.period
        return True
