"""How fast ticks come and what they cost, over the last second on the wall."""
from __future__ import annotations

import math
from collections import deque

WINDOW = 1.0
"""s on the wall."""


class Tempo:
    """Counts ticks. One thread may use it."""

    def __init__(self) -> None:
        self._ticks: deque[tuple[float, float, float]] = deque()

    def tick(self, begin: float, end: float, simulated: float) -> None:
        """Enter a tick of ``simulated`` s, computed between two instants of the wall's clock, s."""
        self._ticks.append((begin, end, simulated))
        while self._ticks[0][0] < begin - WINDOW:
            self._ticks.popleft()

    def forget(self) -> None:
        """Begin anew: what comes next has nothing to do with what was."""
        self._ticks.clear()

    @property
    def pace(self) -> float:
        """Simulated s in each s on the wall; NaN before half a second has gone."""
        if not self._ticks or self._ticks[-1][0] - self._ticks[0][0] < WINDOW / 2:
            return math.nan
        simulated = sum(tick[2] for tick in self._ticks) - self._ticks[0][2]
        return simulated / (self._ticks[-1][0] - self._ticks[0][0])

    @property
    def cost(self) -> float:
        """Mean s on the wall that a tick takes to compute; NaN before the first."""
        if not self._ticks:
            return math.nan
        return sum(end - begin for begin, end, _ in self._ticks) / len(self._ticks)
