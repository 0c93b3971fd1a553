"""The playhead: which instant of a clip is shown, paused or playing."""
from __future__ import annotations

import numpy as np

from ..sources.source import Frame
from .frame_buffer import Clip


class Playhead:
    """Plays a clip at ``speed`` s of it per s of wall time, which is ``now`` in all methods."""

    def __init__(self, clip: Clip, time: float, speed: float = 1.0) -> None:
        self.clip = clip
        self.is_playing = False
        self.speed = speed
        self._time, self._since = time, 0.0

    def time(self, now: float) -> float:
        """Time since the clip's first instant, s; at most its duration."""
        elapsed = (now - self._since) * self.speed if self.is_playing else 0.0
        return min(self._time + elapsed, self.clip.duration)

    def frame(self, now: float) -> Frame:
        """The frame to show, the same object for the same instant; pauses at the clip's end."""
        time = self.time(now)
        if time >= self.clip.duration:
            self.is_playing = False
            self._time = time
        return self.clip.frame(self.clip.index(time))

    def go_to(self, time: float, now: float) -> None:
        """Move to another time, s, and go on playing or stay paused."""
        self._time, self._since = min(max(time, 0.0), self.clip.duration), now

    def step(self, count: int, now: float) -> None:
        """Pause, and move by ``count`` frames."""
        times = self.clip.times
        index = self.clip.index(self.time(now)) + count
        self.is_playing = False
        self.go_to(float(times[min(max(index, 0), len(times) - 1)] - times[0]), now)

    def toggle(self, now: float) -> None:
        """Play or pause; at the end, play from the start of the last run."""
        time = self.time(now)
        self.is_playing = not self.is_playing
        if self.is_playing and time >= self.clip.duration:
            starts = np.flatnonzero(self.clip.resets)
            time = float(self.clip.times[starts[-1]] - self.clip.times[0]) if len(starts) else 0.0
        self.go_to(time, now)

    def set_speed(self, speed: float, now: float) -> None:
        """Set the speed from now on."""
        self.go_to(self.time(now), now)
        self.speed = speed
