"""Rate and cost of ticks over the last second of wall time."""
from __future__ import annotations

import math
from collections import deque

WINDOW = 1.0
"""s of wall time."""


class TickStatistics:
    """Records ticks. Not thread-safe."""

    def __init__(self) -> None:
        self._ticks: deque[tuple[float, float, float]] = deque()

    def add(self, begin: float, end: float, simulated: float) -> None:
        """Record a tick of ``simulated`` s, computed between two instants of wall time, s."""
        self._ticks.append((begin, end, simulated))
        while self._ticks[0][0] < begin - WINDOW:
            self._ticks.popleft()

    def clear(self) -> None:
        """Forget all ticks."""
        self._ticks.clear()

    @property
    def real_time_factor(self) -> float:
        """Simulated time per wall time; NaN before half a window has passed."""
        if not self._ticks or self._ticks[-1][0] - self._ticks[0][0] < WINDOW / 2:
            return math.nan
        simulated = sum(tick[2] for tick in self._ticks) - self._ticks[0][2]
        return simulated / (self._ticks[-1][0] - self._ticks[0][0])

    @property
    def mean_cost(self) -> float:
        """Mean wall time of computing a tick, s; NaN before the first."""
        if not self._ticks:
            return math.nan
        return sum(end - begin for begin, end, _ in self._ticks) / len(self._ticks)
