"""Soft joints: where joints would be if impacts and stops took time, beside the rigid ones.

In the rigid motion an impact changes a joint's rate at once, and the joint may reach its end within
the tick. If the impact takes time, the joint comes later and slower, while its rate still changes.
So a stop begins when the soft joint has caught up with the rigid one. The joint then has the share
a of the rate r, and the pulses bring the rest in the time R. The stop lasts a (pi w / a r) + (1 -
a) R: tissue stops the rate that is there, and the rest as it comes.
"""
from __future__ import annotations

import math

import numpy as np

from .contact_pulse import course


class SoftJoints:
    """Lags of k joint angles and rates behind the rigid ones, tick by tick, in a motion of
    ``count`` states that are ``step`` s apart. A pulse that is over leaves no lag.
    """

    def __init__(self, count: int, joints: int, step: float) -> None:
        self._step, self._at = step, 0
        self._late = np.zeros((count, joints))
        """rad/s that pulses have still to give at the beginning of each tick."""
        self._behind = np.zeros((count, joints))
        """rad by which angles are behind, likewise."""

    def arrival(self, joint: int, sign: int, rate: float) -> tuple[float, float]:
        """Delay, s, until a joint is where the rigid one is, with the ``rate``, rad/s, towards its
        end in the direction ``sign``; and by how much its stop is longer, s.
        """
        late = sign * self._late[self._at:, joint]
        turns = (rate - late) * self._step
        there = np.cumsum(turns) - turns >= sign * self._behind[self._at, joint]
        after = int(there.argmax()) if there.any() else len(late) - 1
        missing = min(max(late[after] / rate, 0.0), 1.0)
        rest = np.flatnonzero(late[after:])
        return after * self._step, missing * self._step * (rest[-1] + 1 if len(rest) else 0)

    def advance(self, changes: np.ndarray, delay: float, duration: float) -> None:
        """Add a tick in which rates change by ``changes`` (k,) rad/s, over a pulse that begins
        ``delay`` s after the beginning of the tick and lasts ``duration`` s.
        """
        self._at += 1
        count = min(math.ceil((delay + duration) / self._step) - 1, len(self._late) - self._at)
        if count > 0:
            late = 1 - np.cumsum(course(count, self._step, delay, duration))
            self._late[self._at:self._at + count] += np.outer(late, changes)
            self._behind[self._at:self._at + count] += np.outer(
                np.cumsum(late) * self._step, changes)
