"""Which time the messages bear."""
from __future__ import annotations

import time
from collections.abc import Callable

STEP_BACK = 1_000_000_000
"""ns that ROS time goes back at the least where it begins anew: a computer's own clock may be set
back by less, which is no reason for stamps that go back."""

SLACK = 5_000_000
"""ns that ROS time may be off a line over the steady clock before stamps follow it: a /clock goes
in jumps, and stamps shall be spaced as the ticks are."""

DOUBT = 200_000
"""ns between two looks at the steady clock, above which ROS time, read between, says too little."""


class Stamps:
    """Stamps in ns: the ROS time at which a state was due on the wall.

    They lie on a line over the steady clock as long as ROS time does, so that ticks that are due at
    equal distances have stamps at equal distances. They never go back, except where ROS time
    itself begins, at the first word of a /clock or as it goes back by more than a second; until
    then they count from zero.

    ``now`` gives ROS time, ns, zero: not known yet; ``steady`` the time that ticks are due by.
    """

    def __init__(self, now: Callable[[], int],
                 steady: Callable[[], int] = time.monotonic_ns) -> None:
        self._now, self._steady = now, steady
        self._seen = now()
        self._offset = self._seen - steady()
        self.newest = self._seen
        """Stamp of the newest state."""

    def take(self, due: float | None = None) -> None:
        """Stamp a new state that was due at this steady time, ns; now, if it is not said."""
        self._follow()
        due = self._steady() if due is None else round(due)
        self.newest = max(due + self._offset, self.newest + 1)

    def _follow(self) -> None:
        """Bring the line back to ROS time where that has left it."""
        before = self._steady()
        now, seen = self._now(), self._seen
        after = self._steady()
        self._seen = now
        if seen == 0 < now or now < seen - STEP_BACK:
            self._offset, self.newest = now - after, 0
        elif now and after - before < DOUBT and abs(now - after - self._offset) > SLACK:
            self._offset = now - after
