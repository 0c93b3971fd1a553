"""Which time the messages bear."""
from __future__ import annotations

from collections.abc import Callable

STEP_BACK = 1_000_000_000
"""ns that ROS time goes back at the least where it begins anew: a computer's own clock may be set
back by less, which is no reason for stamps that do not fit each other."""


class Stamps:
    """Stamps in ns that rise by exactly one tick from state to state.

    They count simulated time from a ROS time, so that they fit the stamps of others, and run at
    the doll's own pace from there. A reset and the end of a pause set them to ROS time again,
    forwards only; a new scene adds one tick. Where ROS time itself begins, at the first word of a
    /clock or as it goes back, they begin with it, be it backwards. While the node itself is the
    clock (``publish_clock``), they are the simulated time and go back to zero at a reset, as
    /clock does.

    ``now`` gives ROS time, ns; zero: not known yet.
    """

    def __init__(self, now: Callable[[], int]) -> None:
        self._now = now
        self.start = self._seen = now()
        """Stamp of simulated time zero."""

    def follow(self, time: int) -> None:
        """Begin at ROS time where that itself begins; for every state, before its stamp."""
        now, seen = self._now(), self._seen
        self._seen = now
        if seen == 0 < now or now < seen - STEP_BACK:
            self.start = now - time

    def begin_again(self, time: int, tick: int) -> None:
        """Let simulated time begin at zero again, after it has reached ``time``."""
        self.start += time + tick

    def catch_up(self, time: int) -> None:
        """Let simulated ``time`` be now, unless that is behind the stamps already."""
        self.start = max(self.start, self._now() - time)

    def at(self, time: int, is_clock: bool) -> int:
        """Stamp of a simulated time, ns."""
        return time if is_clock else self.start + time
