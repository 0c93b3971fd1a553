"""Which time the messages bear."""
from __future__ import annotations


class Stamps:
    """Stamps in ns that rise by exactly one tick from state to state.

    They count simulated time from the ROS time at which the node began, so that they fit the
    stamps of others at the start and run at the doll's own pace from there; a reset or a new
    scene adds one tick as well. While the node itself is the clock (``publish_clock``), they
    are the simulated time and go back to zero at a reset, as /clock does.
    """

    def __init__(self, start: int) -> None:
        self.start = start
        """Stamp of simulated time zero."""

    def begin_again(self, time: int, tick: int) -> None:
        """Let simulated time begin at zero again, after it has reached ``time``."""
        self.start += time + tick

    def at(self, time: int, is_clock: bool) -> int:
        """Stamp of a simulated time, ns."""
        return time if is_clock else self.start + time
