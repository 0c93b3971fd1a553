"""Frames by their instants: the last ones of a source, and those of a whole recording."""
from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...physics.rigid_body import GroundHeights
from ...recordings.recording import RecordedPose, Recorder, Recording
from ..sources.source import Frame

MAX_FRAMES = 30_000
"""Five minutes in ticks of 10 ms. Objects are half as large as the numbers of ten bones."""

MAX_NUMBERS = 5_000_000
"""40 MB: MAX_FRAMES of a doll of ten bones, half of that with contacts; less of more dolls."""

TOUCH = 1e-3
"""m above the ground at which a bone counts as touching it, also while it bounces."""

CONTACT_PERIOD = 0.05
"""s of simulated time between two tests for ground contact."""

COLUMNS = np.dtype([('time', float), ('pushed', bool), ('touching', bool), ('resets', bool)])
"""What is kept beside each frame; see Clip."""


@dataclass(frozen=True)
class Clip:
    """A fixed sequence of frames at k ascending instants, s."""

    times: np.ndarray
    """s since the first frame of the source; they continue over resets."""
    frame: Callable[[int], Frame]
    """Frame of an index."""
    pushed: np.ndarray
    """(k,) bool: whether a push or a hand acts."""
    touching: np.ndarray
    """(k,) bool: whether a bone touches the ground or anything else."""
    resets: np.ndarray
    """(k,) bool: whether it is the first frame after a reset."""
    is_cut: bool = False
    """Whether there were frames before that have made room."""

    @property
    def duration(self) -> float:
        """Time from the first instant to the last, s."""
        return float(self.times[-1] - self.times[0])

    def index(self, time: float) -> int:
        """Index of the last frame at or before ``time`` s after the first."""
        # The values of a slider are rounded to decimals: tolerate half a nanosecond.
        following = np.searchsorted(self.times - self.times[0], time + 5e-10, 'right')
        return max(int(following) - 1, 0)

    def run(self, index: int) -> range:
        """Indices of all frames of the run that a frame is of, from a reset to the next."""
        starts = np.flatnonzero(self.resets)
        following = int(np.searchsorted(starts, index, 'right'))
        return range(int(starts[following - 1]) if following else 0,
                     int(starts[following]) if following < len(starts) else len(self.times))

    def part(self, indices: range) -> Clip:
        """The frames of a range of contiguous indices, which must not be empty."""
        part, first = slice(indices.start, indices.stop), indices.start
        return Clip(self.times[part], lambda index: self.frame(first + index), self.pushed[part],
                    self.touching[part], self.resets[part], self.is_cut or first > 0)

    def recording(self) -> Recording:
        """All frames as a recording."""
        recorder = Recorder(self.frame(0).scene)
        for index, time in enumerate((self.times - self.times[0]).tolist()):
            frame = self.frame(index)
            recorder.add(time, RecordedPose(frame.state.positions, frame.state.orientations,
                                            frame.rods))
        return recorder.recording()


class FrameBuffer:
    """The last frames of one scene, up to MAX_FRAMES and MAX_NUMBERS; another scene clears it."""

    def __init__(self) -> None:
        self._frames: deque[Frame] = deque()
        self._columns = np.empty(1024, COLUMNS)
        """Rows of the frames end at ``_end``."""
        self._clear()

    def __len__(self) -> int:
        return len(self._frames)

    @property
    def end(self) -> float:
        """Instant of the newest frame, s."""
        return float(self._rows['time'][-1]) if self._frames else 0.0

    @property
    def duration(self) -> float:
        """Time from the oldest frame to the newest, s."""
        return self.end - float(self._rows['time'][0]) if self._frames else 0.0

    def add(self, frame: Frame) -> bool | None:
        """Keep a frame, which must not be changed later. Return whether it is the first after a
        reset, or None if it has the same instant as the last one.
        """
        last = self._frames[-1] if self._frames else None
        if last is not None and last.scene is not frame.scene:
            self._clear()
            last = None
        time, resets = 0.0, False
        if last is None:
            self._heights = GroundHeights(frame.scene)
        elif (frame.run, frame.time) == (last.run, last.time):
            return None
        else:
            resets = frame.run != last.run or frame.time < last.time
            # A tick with a reset has no known length: it counts as long as the one before.
            time = self.end + (self._last_step() if resets else frame.time - last.time)
        touches = self._touches_ground(frame, time) or has_contacts(frame)
        self._append(frame, (time, bool(frame.pushes or frame.grabs), touches, resets))
        self._drop_old()
        return resets

    def clip(self) -> Clip:
        """The frames that are kept now, at least one; later frames do not change the clip."""
        frames, rows = tuple(self._frames), self._rows.copy()
        return Clip(rows['time'], frames.__getitem__, rows['pushed'], rows['touching'],
                    rows['resets'], self._is_cut)

    @property
    def _rows(self) -> np.ndarray:
        """Rows of ``_columns`` of the frames that are kept."""
        return self._columns[self._end - len(self._frames):self._end]

    def _clear(self) -> None:
        self._frames.clear()
        self._end = self._numbers = 0
        self._is_cut = self._on_ground = False
        self._last_ground_test = -math.inf

    def _append(self, frame: Frame, row: tuple[float, bool, bool, bool]) -> None:
        if self._end == len(self._columns):
            rows = self._rows
            columns = np.empty(max(1024, 2 * len(rows)), COLUMNS)
            columns[:len(rows)] = rows
            self._columns, self._end = columns, len(rows)
        self._columns[self._end] = row
        self._end += 1
        self._frames.append(frame)
        self._numbers += _numbers(frame)

    def _touches_ground(self, frame: Frame, time: float) -> bool:
        """Whether a bone touches the ground; tested at intervals, as it is slow for a crowd."""
        if time >= self._last_ground_test + CONTACT_PERIOD:
            self._last_ground_test = time
            self._on_ground = bool(self._heights(frame.state).min() < TOUCH)
        return self._on_ground

    def _last_step(self) -> float:
        times = self._rows['time'][-2:]
        return float(times[1] - times[0]) if len(times) > 1 else self._frames[-1].scene.step

    def _drop_old(self) -> None:
        """Drop the oldest frames while there are too many."""
        frames = self._frames
        while len(frames) > MAX_FRAMES or (self._numbers > MAX_NUMBERS and len(frames) > 2):
            self._numbers -= _numbers(frames.popleft())
            self._is_cut = True


def has_contacts(frame: Frame) -> bool:
    """Whether a frame has contacts with the ground, static bodies or other dolls. Without
    ``pairs``, contacts between bones of one doll count, too.
    """
    if frame.contacts is None or frame.pairs is None:
        return frame.contacts is not None and len(frame.contacts) > 0
    dolls = frame.scene.doll_of_bone
    first, second = frame.pairs[:, 0], frame.pairs[:, 1]
    return bool(((second < 0) | (dolls[first] != dolls[second])).any())


def _numbers(frame: Frame) -> int:
    """Count of the numbers that a frame holds."""
    return frame.state.rows.size + sum(
        each.size for each in (frame.rods, frame.contacts, frame.forces, frame.pairs, frame.angles)
        if each is not None)


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
