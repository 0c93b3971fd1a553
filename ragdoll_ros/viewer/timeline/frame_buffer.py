"""The last while of what a page has shown, and a whole recording: frames by their instants."""
from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...physics.rigid_body import GroundHeights
from ...recordings.recording import RecordedPose, Recorder, Recording
from ..sources.source import Frame

SPAN = 60.0
"""s of simulated time that are kept."""

MOST_FRAMES = 6000
"""As many as SPAN has at the page's 60 a second and at half the real time, and some more."""

MOST_NUMBERS = 5_000_000
"""40 MB: 60 s at 60 a second of six dolls of ten bones; of more dolls it is less."""

TOUCH = 1e-3
"""m above the ground within which a bone touches it: where it bounces, too."""

LOOK_PERIOD = 0.05
"""s of simulated time between two looks at what touches."""


@dataclass(frozen=True)
class Moment:
    """A frame on the timeline, which goes on over resets."""

    time: float
    """s since the first that was kept."""
    frame: Frame
    pushed: bool
    """Whether a push or a hand acts."""
    touching: bool
    """Whether something touches the ground."""
    begins: bool
    """Whether the simulated time begins anew with it."""


@dataclass(frozen=True)
class Cut:
    """Frames to be looked at: k instants, ascending, s, and what was there."""

    times: np.ndarray
    frame: Callable[[int], Frame]
    pushed: np.ndarray
    """(k,) bool, as Moment's; and so are the two that follow."""
    touching: np.ndarray
    begins: np.ndarray

    @property
    def duration(self) -> float:
        """From the first instant to the last, s."""
        return float(self.times[-1] - self.times[0])

    def index(self, time: float) -> int:
        """Which instant is the last at or before ``time`` s after the first."""
        # A slider's values are decimal: half a nanosecond is none.
        following = np.searchsorted(self.times - self.times[0], time + 5e-10, 'right')
        return max(int(following) - 1, 0)

    def recording(self) -> Recording:
        """All of it as a recording."""
        recorder = Recorder(self.frame(0).scene)
        for index, time in enumerate((self.times - self.times[0]).tolist()):
            frame = self.frame(index)
            recorder.add(time, RecordedPose(frame.state.positions, frame.state.orientations,
                                            frame.rods))
        return recorder.recording()


class History:
    """The last SPAN s of one scene's frames, as they come; another scene begins anew."""

    def __init__(self) -> None:
        self._moments: deque[Moment] = deque()
        self._heights: GroundHeights | None = None
        self._looked = 0.0

    def __len__(self) -> int:
        return len(self._moments)

    @property
    def end(self) -> float:
        """Instant of the newest frame, s."""
        return self._moments[-1].time if self._moments else 0.0

    def take(self, frame: Frame) -> Moment | None:
        """Keep a frame, which must stay as it is; None for an instant that is there already."""
        last = self._moments[-1] if self._moments else None
        if last is not None and last.frame.scene is not frame.scene:
            self._moments.clear()
            last = None
        if last is None:
            self._heights, self._looked = GroundHeights(frame.scene), -np.inf
            moment = Moment(0.0, frame, _is_pushed(frame), self._touches(frame, 0.0, False), False)
        elif frame.time == last.frame.time:
            return None
        else:
            begins = frame.time < last.frame.time
            # After a reset a tick is as long as the one before: nobody tells how long it took.
            gone = self._step(last) if begins else frame.time - last.frame.time
            time = last.time + gone
            moment = Moment(time, frame, _is_pushed(frame),
                            self._touches(frame, time, last.touching), begins)
        self._moments.append(moment)
        self._forget()
        return moment

    def cut(self) -> Cut:
        """What is kept now; what comes does not change it. At least one frame must be there."""
        moments = tuple(self._moments)
        return Cut(np.array([moment.time for moment in moments]),
                   lambda index: moments[index].frame,
                   *(np.array([getattr(moment, key) for moment in moments])
                     for key in ('pushed', 'touching', 'begins')))

    def _touches(self, frame: Frame, time: float, before: bool) -> bool:
        """Whether something touches the ground, as of the last look: a crowd's takes a while."""
        if time < self._looked + LOOK_PERIOD:
            return before
        self._looked = time
        return bool(self._heights(frame.state).min() < TOUCH)

    def _step(self, last: Moment) -> float:
        before = self._moments[-2] if len(self._moments) > 1 else None
        return last.time - before.time if before is not None else last.frame.scene.step

    def _forget(self) -> None:
        """Drop what is too old, or too much."""
        moments = self._moments
        frame = moments[-1].frame
        numbers = frame.state.rows.size + np.size(frame.rods)
        most = min(MOST_FRAMES, max(2, MOST_NUMBERS // numbers))
        while len(moments) > most or moments[-1].time - moments[0].time > SPAN:
            moments.popleft()


def cut_of(recording: Recording, frame_at: Callable[[float], Frame]) -> Cut:
    """All of a recording; ``frame_at`` gives the frame of an instant of it."""
    heights, times = GroundHeights(recording.scene), recording.times
    touching, looked = np.zeros(len(times), bool), -np.inf
    for index, time in enumerate(times):
        if time >= looked + max(LOOK_PERIOD, recording.duration / 1000):
            looked = time
            touches = bool(heights(frame_at(time).state).min() < TOUCH)
        touching[index] = touches
    nothing = np.zeros(len(times), bool)
    return Cut(times, lambda index: frame_at(float(times[index])), nothing, touching, nothing)


def _is_pushed(frame: Frame) -> bool:
    return bool(frame.pushes or frame.held)
