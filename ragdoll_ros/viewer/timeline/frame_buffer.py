"""Frames by their instants: those of the last minute, and those of a whole recording."""
from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from operator import attrgetter

import numpy as np

from ...physics.rigid_body import GroundHeights
from ...recordings.recording import RecordedPose, Recorder, Recording
from ..sources.source import Frame

SPAN = 60.0
"""s of simulated time that are kept."""

MAX_FRAMES = 30_000
"""SPAN in ticks of 2 ms."""

MAX_NUMBERS = 5_000_000
"""40 MB: SPAN in ticks of 10 ms of six dolls of ten bones; less time of more dolls."""

TOUCH = 1e-3
"""m above the ground at which a bone counts as touching it, also while it bounces."""

CONTACT_PERIOD = 0.05
"""s of simulated time between two tests for ground contact."""


@dataclass(frozen=True)
class TimelineFrame:
    """A frame with its instant on the timeline, which continues over resets."""

    time: float
    """s since the first frame that was kept."""
    frame: Frame
    pushed: bool
    """Whether a push or a hand acts."""
    touching: bool
    """Whether a bone touches the ground."""
    resets: bool
    """Whether it is the first frame after a reset."""


@dataclass(frozen=True)
class Clip:
    """A fixed sequence of frames at k ascending instants, s."""

    times: np.ndarray
    frame: Callable[[int], Frame]
    """Frame of an index."""
    pushed: np.ndarray
    """(k,) bool, as in TimelineFrame; the next two as well."""
    touching: np.ndarray
    resets: np.ndarray

    @property
    def duration(self) -> float:
        """Time from the first instant to the last, s."""
        return float(self.times[-1] - self.times[0])

    def index(self, time: float) -> int:
        """Index of the last frame at or before ``time`` s after the first."""
        # The values of a slider are rounded to decimals: tolerate half a nanosecond.
        following = np.searchsorted(self.times - self.times[0], time + 5e-10, 'right')
        return max(int(following) - 1, 0)

    def recording(self) -> Recording:
        """All frames as a recording."""
        recorder = Recorder(self.frame(0).scene)
        for index, time in enumerate((self.times - self.times[0]).tolist()):
            frame = self.frame(index)
            recorder.add(time, RecordedPose(frame.state.positions, frame.state.orientations,
                                            frame.rods))
        return recorder.recording()


class FrameBuffer:
    """Ring buffer of the last SPAN s of one scene; another scene clears it."""

    def __init__(self) -> None:
        self._frames: deque[TimelineFrame] = deque()
        self._heights: GroundHeights | None = None
        self._last_contact_test = 0.0

    def __len__(self) -> int:
        return len(self._frames)

    @property
    def end(self) -> float:
        """Instant of the newest frame, s."""
        return self._frames[-1].time if self._frames else 0.0

    @property
    def duration(self) -> float:
        """Time from the oldest frame to the newest, s."""
        return self.end - self._frames[0].time if self._frames else 0.0

    def add(self, frame: Frame) -> TimelineFrame | None:
        """Keep a frame, which must not be changed later; None if its instant is the last one's."""
        last = self._frames[-1] if self._frames else None
        if last is not None and last.frame.scene is not frame.scene:
            self._frames.clear()
            last = None
        time, was_touching, resets = 0.0, False, False
        if last is None:
            self._heights, self._last_contact_test = GroundHeights(frame.scene), -np.inf
        elif (frame.run, frame.time) == (last.frame.run, last.frame.time):
            return None
        else:
            was_touching = last.touching
            resets = frame.run != last.frame.run or frame.time < last.frame.time
            # A tick with a reset has no known length: it counts as long as the one before.
            time = last.time + (self._last_step() if resets else frame.time - last.frame.time)
        entry = TimelineFrame(time, frame, bool(frame.pushes or frame.grabs),
                              self._touches(frame, time, was_touching), resets)
        self._frames.append(entry)
        self._drop_old()
        return entry

    def clip(self) -> Clip:
        """The frames that are kept now, at least one; later frames do not change the clip."""
        frames = tuple(self._frames)
        return Clip(_column(frames, 'time', float), lambda index: frames[index].frame,
                    *(_column(frames, key, bool) for key in ('pushed', 'touching', 'resets')))

    def _touches(self, frame: Frame, time: float, before: bool) -> bool:
        """Whether a bone touches the ground; tested at intervals, as it is slow for a crowd."""
        if time < self._last_contact_test + CONTACT_PERIOD:
            return before
        self._last_contact_test = time
        return bool(self._heights(frame.state).min() < TOUCH)

    def _last_step(self) -> float:
        last = self._frames[-1]
        before = self._frames[-2] if len(self._frames) > 1 else None
        return last.time - before.time if before is not None else last.frame.scene.step

    def _drop_old(self) -> None:
        """Drop frames that are too old or too many."""
        frames = self._frames
        frame = frames[-1].frame
        numbers = frame.state.rows.size + np.size(frame.rods)
        limit = min(MAX_FRAMES, max(2, MAX_NUMBERS // numbers))
        while len(frames) > limit or frames[-1].time - frames[0].time > SPAN:
            frames.popleft()


def _column(frames: tuple[TimelineFrame, ...], key: str, kind: type) -> np.ndarray:
    return np.fromiter(map(attrgetter(key), frames), kind, len(frames))


def clip_of(recording: Recording, frame_at: Callable[[float], Frame]) -> Clip:
    """A whole recording as a clip; ``frame_at`` gives the frame of an instant."""
    heights, times = GroundHeights(recording.scene), recording.times
    touching, last = np.zeros(len(times), bool), -np.inf
    for index, time in enumerate(times):
        if time >= last + max(CONTACT_PERIOD, recording.duration / 1000):
            last = time
            touches = bool(heights(frame_at(time).state).min() < TOUCH)
        touching[index] = touches
    never = np.zeros(len(times), bool)
    return Clip(times, lambda index: frame_at(float(times[index])), never, touching, never)
