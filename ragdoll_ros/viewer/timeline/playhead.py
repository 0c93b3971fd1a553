"""A look back: which instant of a cut is shown, standing or playing."""
from __future__ import annotations

from ..sources.source import Frame
from .frame_buffer import Cut


class Look:
    """Goes over a cut by the clock on the wall, ``now`` in s; ``speed`` is s of it in each s."""

    def __init__(self, cut: Cut, time: float, speed: float = 1.0) -> None:
        self.cut = cut
        self.plays = False
        self._speed = speed
        self._time, self._since = time, 0.0

    def time(self, now: float) -> float:
        """S after the cut's first instant; at its end it stands."""
        gone = (now - self._since) * self._speed if self.plays else 0.0
        return min(self._time + gone, self.cut.duration)

    def frame(self, now: float) -> Frame:
        """What is to be shown: the same object while it is the same instant."""
        time = self.time(now)
        if time >= self.cut.duration:
            self.plays = False
            self._time = time
        return self.cut.frame(self.cut.index(time))

    def go_to(self, time: float, now: float) -> None:
        """Go on, or stand, from another instant."""
        self._time, self._since = min(max(time, 0.0), self.cut.duration), now

    def step(self, count: int, now: float) -> None:
        """Stand ``count`` frames later, or before."""
        times = self.cut.times
        index = self.cut.index(self.time(now)) + count
        self.plays = False
        self.go_to(float(times[min(max(index, 0), len(times) - 1)] - times[0]), now)

    def toggle(self, now: float) -> None:
        """Play, or stand; at the end play from the beginning."""
        time = self.time(now)
        self.plays = not self.plays
        self.go_to(0.0 if self.plays and time >= self.cut.duration else time, now)

    def set_speed(self, speed: float, now: float) -> None:
        """Go faster or slower from here on."""
        self.go_to(self.time(now), now)
        self._speed = speed
