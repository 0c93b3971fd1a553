"""A recorded run as a source: it plays, pauses, steps, starts again; nothing can change it."""
from __future__ import annotations

import threading
import time

import numpy as np

from ...model import errors
from ...model.scene import Scene
from ...model.state import State
from ...recordings.recording import Recording
from .source import PACES, Frame, Report, Source, Wanted


class Fixed(errors.RagdollError):
    """A wish that a recording cannot grant."""


class Playback(Source):
    """Plays a recording by the clock on the wall while a page is open; at its end it stands.

    A push or a hand does nothing, as in any source without: what was recorded is over.
    """

    def __init__(self, recording: Recording, name: str = 'recording') -> None:
        self._recording = recording
        self._name = name
        self._lock = threading.Lock()
        self._wanted = False
        self._paused = False
        self._pace = 1.0
        self._time = 0.0
        """s of the recording at the instant _since on the wall."""
        self._since = time.monotonic()
        self._frame = self.frame_at(0.0)

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

    @property
    def report(self) -> Report:
        with self._lock:
            instant = self._now()
            end = self._recording.duration
            note = f'{self._name}: {instant:.1f} of {end:.1f} s'
            return Report(note=note, paused=self._paused or instant >= end, pace=self._pace)

    def want(self, wanted: Wanted) -> None:
        with self._lock:
            self._go_on_from(self._now())
            self._wanted = wanted.frames

    def pause(self, wanted: bool) -> bool:
        """Hold the time, or let it go on; at the end it stands, and goes on from the start."""
        with self._lock:
            instant = self._now()
            self._paused = wanted and instant < self._recording.duration
            self._go_on_from(0.0 if instant >= self._recording.duration and not wanted else instant)
        return True

    def step(self) -> None:
        with self._lock:
            if self._paused:
                times = self._recording.times
                following = int(np.searchsorted(times, self._now(), 'right'))
                self._go_on_from(float(times[min(following, len(times) - 1)]))

    def reset(self) -> None:
        with self._lock:
            self._go_on_from(0.0)

    def set_pace(self, pace: float) -> None:
        """Go faster or slower; OutOfRange."""
        errors.check_range('pace', pace, *PACES)
        with self._lock:
            self._go_on_from(self._now())
            self._pace = pace

    def load(self, name: str) -> None:
        raise Fixed(f'a recording has one scene; for another: ragdoll_viewer --scene {name}')

    def take_engine(self, name: str) -> None:
        raise Fixed('a recording was simulated once and for all')

    def use(self, scene: Scene) -> None:
        raise Fixed('a recording has one scene; to change it: ragdoll_viewer --scene')

    def _now(self) -> float:
        """Instant of the recording, s."""
        gone = 0.0
        if self._wanted and not self._paused:
            gone = (time.monotonic() - self._since) * self._pace
        return min(self._time + gone, self._recording.duration)

    def _go_on_from(self, instant: float) -> None:
        self._time, self._since = instant, time.monotonic()

    def frame_at(self, instant: float) -> Frame:
        """What is there at an instant, s."""
        pose = self._recording.at(instant)
        unknown = np.full(pose.positions.shape, np.nan)
        state = State(pose.positions, pose.orientations, unknown, unknown)
        return Frame(self._recording.scene, instant, state, rods=pose.rods)
