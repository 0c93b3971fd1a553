"""A recorded run as a source: it plays, pauses, steps and restarts; nothing can change it."""
from __future__ import annotations

import threading
import time

import numpy as np

from ...model import errors
from ...model.scene import Scene
from ...model.state import State
from ...recordings.recording import Recording
from .source import REAL_TIME_FACTORS, Frame, RequestedData, Source, SourceStatus


class ReadOnly(errors.RagdollError):
    """A command that would change a recording."""


class PlaybackSource(Source):
    """Plays a recording in wall time while a page is open; pauses at its end."""

    def __init__(self, recording: Recording, name: str = 'recording') -> None:
        self._recording = recording
        self._name = name
        self._lock = threading.Lock()
        self._is_open = False
        self._paused = False
        self._real_time_factor = 1.0
        self._time = 0.0
        """s of the recording at the wall time _since."""
        self._since = time.monotonic()
        self._frame = self.frame_at(0.0)
        self._taken: Frame | None = None

    @property
    def recording(self) -> Recording:
        return self._recording

    @property
    def frame(self) -> Frame:
        with self._lock:
            instant = self._now()
            if instant != self._frame.time:
                self._frame = self.frame_at(instant)
            return self._frame

    def take_frames(self) -> list[Frame]:
        last, frame = self._taken, self.frame
        self._taken = frame
        return [] if frame is last else [frame]

    @property
    def status(self) -> SourceStatus:
        with self._lock:
            instant = self._now()
            end = self._recording.duration
            note = f'{self._name}: {instant:.1f} of {end:.1f} s'
            return SourceStatus(note=note, paused=self._paused or instant >= end,
                                real_time_factor=self._real_time_factor)

    def request(self, requested: RequestedData) -> None:
        with self._lock:
            self._note_time()
            self._is_open = requested.frames

    def pause(self, paused: bool) -> bool:
        """Pause or resume; at the end it is paused, and resumes from the start."""
        with self._lock:
            self._note_time()
            at_end = self._time >= self._recording.duration
            self._paused = paused and not at_end
            if at_end and not paused:
                self._continue_from(0.0)
        return True

    def step(self) -> None:
        with self._lock:
            if self._paused:
                times = self._recording.times
                following = int(np.searchsorted(times, self._now(), 'right'))
                self._continue_from(float(times[min(following, len(times) - 1)]))

    def reset(self) -> None:
        with self._lock:
            self._continue_from(0.0)

    def seek(self, instant: float) -> None:
        with self._lock:
            self._paused = True
            self._continue_from(min(max(instant, 0.0), self._recording.duration))

    def set_real_time_factor(self, factor: float) -> None:
        errors.check_range('real_time_factor', factor, *REAL_TIME_FACTORS)
        with self._lock:
            self._note_time()
            self._real_time_factor = factor

    def load(self, name: str) -> None:
        raise ReadOnly(f'a recording has one scene; for another: ragdoll_viewer --scene {name}')

    def set_engine(self, name: str) -> None:
        raise ReadOnly('a recording is not simulated again')

    def set_scene(self, scene: Scene) -> None:
        raise ReadOnly('a recording has one scene; to change it: ragdoll_viewer --scene')

    def _now(self) -> float:
        """Instant of the recording, s."""
        return self._at(time.monotonic())

    def _at(self, wall: float) -> float:
        """Instant of the recording, s, at a wall time."""
        elapsed = 0.0
        if self._is_open and not self._paused:
            elapsed = (wall - self._since) * self._real_time_factor
        return min(self._time + elapsed, self._recording.duration)

    def _note_time(self) -> None:
        """Count time from the current instant on, as the next change alters how time passes."""
        wall = time.monotonic()
        self._time, self._since = self._at(wall), wall

    def _continue_from(self, instant: float) -> None:
        self._time, self._since = instant, time.monotonic()

    def frame_at(self, instant: float) -> Frame:
        """Frame of the recording at an instant, s."""
        pose = self._recording.at(instant)
        unknown = np.full(pose.positions.shape, np.nan)
        state = State(pose.positions, pose.orientations, unknown, unknown)
        return Frame(self._recording.scene, instant, state, rods=pose.rods)
