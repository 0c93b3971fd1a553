"""Stamps of the messages: ROS time, evenly spaced."""
from __future__ import annotations

import time
from collections.abc import Callable

MIN_JUMP_BACK = 1_000_000_000
"""ns by which ROS time must go back to count as a restart; a system clock may be set back by less,
and stamps are not to go back then."""

MAX_DRIFT = 5_000_000
"""ns between ROS time and its extrapolation before stamps follow ROS time: a /clock advances in
steps, and stamps are to be spaced as the ticks are."""

MAX_READ_TIME = 200_000
"""ns between two readings of the steady clock above which a ROS time read between is not used."""


class Stamps:
    """Stamps in ns: the ROS time at which each state was due.

    A stamp is the steady time plus an offset, so evenly spaced ticks have evenly spaced stamps. The
    offset changes if ROS time restarts, or departs from that sum by more than MAX_DRIFT. Stamps
    never go back, except where ROS time restarts: at the first message of a /clock, or when it
    jumps back by more than a second. Before the first /clock they count from zero.

    ``now`` returns ROS time, ns, 0 while unknown; ``steady`` the clock of the ticks' due times, ns.
    """

    def __init__(self, now: Callable[[], int],
                 steady: Callable[[], int] = time.monotonic_ns) -> None:
        self._now, self._steady = now, steady
        self._last_now = now()
        self._offset = self._last_now - steady()
        self.latest = self._last_now
        """Stamp of the latest state."""

    def advance(self, due: float | None = None) -> None:
        """Stamp a new state that was ``due`` at this steady time, ns; default: now."""
        self._update_offset()
        due = self._steady() if due is None else round(due)
        self.latest = max(due + self._offset, self.latest + 1)

    def _update_offset(self) -> None:
        """Follow ROS time after a jump or a drift."""
        before = self._steady()
        now, last = self._now(), self._last_now
        after = self._steady()
        self._last_now = now
        if last == 0 < now or now < last - MIN_JUMP_BACK:
            self._offset, self.latest = now - after, 0
        elif now and after - before < MAX_READ_TIME and abs(now - after - self._offset) > MAX_DRIFT:
            self._offset = now - after
