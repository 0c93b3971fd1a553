"""Limit on pushes, so that they do not accelerate a doll beyond a speed."""
from __future__ import annotations

from collections import deque

import numpy as np

TOP_SPEED, TOP_SPEEDS = 3.0, (0.5, 20.0)
"""m/s that a held key brings the doll to: by default, a run, and the range of the setting."""

RESPONSE_TIME = 0.15
"""s in which the force of a held key would give the speed that is missing: too short to be felt,
and longer than DELAY, so that the speed is not passed."""

LONGEST = 0.1
"""s simulated that a push may last where a busy machine ends it late: a node's push_timeout."""

DELAY = 0.12
"""s of wall time until a push shows in the frames: a node's messages take that there and back."""


class SpeedLimit:
    """Computes the impulse that a doll still lacks to reach a speed, less pushes on their way.

    ``time``: simulated time of the newest frame, s. Where a busy machine delays frames, the delay
    until a push shows is the same in simulated time. ``longest``: longest duration of a push, s
    simulated. Not thread-safe.
    """

    def __init__(self, longest: float = LONGEST) -> None:
        self._longest = longest
        self._recent: deque[tuple[float, np.ndarray]] = deque()
        """Time until which a push that was sent does not show; its largest impulse, (3,) N s."""

    def impulse(self, direction: np.ndarray, missing: float, mass: float, time: float) -> float:
        """Impulse, N s, 0 or more, along the unit vector ``direction`` (3,).

        ``missing``: speed, m/s, that a doll of ``mass`` kg lacks in the newest frame.
        """
        while self._recent and self._recent[0][0] <= time:
            self._recent.popleft()
        on_the_way = sum((float(impulse @ direction) for _, impulse in self._recent), 0.0)
        return max(0.0, mass * missing - on_the_way)

    def sent(self, force: np.ndarray, time: float, real_time_factor: float) -> None:
        """Record the force (3,) N of a push that is sent now."""
        self._recent.append((time + DELAY * real_time_factor, force * self._longest))

    def clear(self) -> None:
        """Forget all pushes, as at a reset."""
        self._recent.clear()
