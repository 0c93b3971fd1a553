"""The timeline: which instant is shown, the newest or a past one."""
from __future__ import annotations

import threading
import time

import numpy as np

from ..sources.source import Frame, Source
from .frame_buffer import MAX_FRAMES, Clip, FrameBuffer, clip_of
from .playhead import Playhead


class Timeline:
    """Keeps the source's frames with `add`; `frame_to_show` is what the page draws instead.

    Past frames come from a buffer: the source is not involved and continues. A reset or another
    scene returns to the live frames. A recording needs no buffer: its source is moved to the chosen
    instant.
    """

    def __init__(self, source: Source) -> None:
        self._source = source
        self._buffer = FrameBuffer()
        self._playhead: Playhead | None = None
        """None: live."""
        self._recorded: Clip | None = None
        """The whole of a recording; None for other sources."""
        self._held: Playhead | None = None
        """The playhead that `hold` created, until it is used."""
        self._holder: int | None = None
        self._lock = threading.RLock()
        if source.recording is not None:
            self._recorded = clip_of(source.recording, source.frame_at)

    @property
    def is_live(self) -> bool:
        """Whether the newest frame is shown."""
        return self._playhead is None

    @property
    def is_playing(self) -> bool:
        """Whether the past is replayed."""
        playhead = self._playhead
        return playhead is not None and playhead.is_playing

    @property
    def speed(self) -> float | None:
        """Simulated time per wall time of the replay; None if live."""
        playhead = self._playhead
        return None if playhead is None else playhead.speed

    @property
    def clip(self) -> Clip | None:
        """What the timeline spans now; None before the first frame."""
        with self._lock:
            if self._playhead is not None:
                return self._playhead.clip
            return self._recorded or (self._buffer.clip() if len(self._buffer) else None)

    @property
    def duration(self) -> float:
        """Time that the timeline spans now, s."""
        with self._lock:
            clip = self._recorded if self._playhead is None else self._playhead.clip
            return self._buffer.duration if clip is None else clip.duration

    def add(self, frame: Frame) -> None:
        """Keep a new frame of the source."""
        with self._lock:
            if self._recorded is not None:
                return
            resets = self._buffer.add(frame)
            if self._playhead is not None and (
                    resets or frame.scene is not self._playhead.clip.frame(0).scene):
                self._playhead = None

    def frame_to_show(self, live: Frame, now: float) -> Frame:
        """The frame to draw at ``now`` s of a steady clock."""
        with self._lock:
            playhead = self._playhead
            return live if playhead is None else playhead.frame(now)

    def live_instant(self, live: Frame) -> float:
        """Instant of the source's newest frame on the timeline, s."""
        return live.time if self._recorded is not None else self._buffer.end

    def shown_instant(self, now: float) -> float | None:
        """Instant that is shown, s of the timeline; None if live."""
        with self._lock:
            playhead = self._playhead
            return None if playhead is None else playhead.clip.times[0] + playhead.time(now)

    def position(self, live: Frame, now: float) -> float:
        """Time of the shown instant since the start of the clip, s."""
        with self._lock:
            if self._playhead is not None:
                return self._playhead.time(now)
            return live.time if self._recorded is not None else self._buffer.duration

    def go_to(self, position: float) -> None:
        """Show the instant ``position`` s after the start of the clip."""
        with self._lock:
            if self._recorded is not None:
                self._source.seek(position)
                return
            playhead = self._start_playhead()
            if playhead is not None:
                playhead.go_to(position, time.monotonic())

    def go_to_time(self, simulated: float) -> str:
        """Show the frame of a simulated time, s, of the run that is shown. Return a text on what is
        kept if that time is not, else an empty one.
        """
        with self._lock:
            playhead = self._start_playhead() if self._recorded is None else None
            if playhead is None:
                self.go_to(simulated)
                return '' if self._recorded is None else _missing(
                    simulated, 0.0, self._recorded.duration, False)
            clip = playhead.clip
            run = clip.run(clip.index(playhead.time(time.monotonic())))
            times = [clip.frame(k).time for k in run]
            found = run[max(int(np.searchsorted(times, simulated + 5e-10, 'right')) - 1, 0)]
            self.go_to(float(clip.times[found] - clip.times[0]))
            return _missing(simulated, times[0], times[-1], clip.is_cut and run.start == 0)

    def go_live(self) -> None:
        """Show the newest frame."""
        with self._lock:
            self._playhead = None

    def hold(self, client: int) -> None:
        """Stop at the shown instant while the user of a page types a time."""
        with self._lock:
            self._holder = client
            if self._recorded is None:
                was_live = self._playhead is None
                playhead = self._start_playhead()
                if playhead is not None and playhead.is_playing:
                    playhead.toggle(time.monotonic())
                self._held = playhead if was_live else None

    def release(self, client: int) -> None:
        """Return to the live frames if `hold` of this page left them and nothing was done since."""
        with self._lock:
            if client == self._holder and self._held is self._playhead:
                self._playhead = None

    def toggle(self) -> None:
        """Play or stop the replay."""
        with self._lock:
            if self._playhead is not None:
                self._playhead.toggle(time.monotonic())

    def step(self, count: int) -> None:
        """Stop, and move by ``count`` frames."""
        with self._lock:
            if self._recorded is not None:
                times = self._recorded.times - self._recorded.times[0]
                index = self._recorded.index(self._source.frame.time) + count
                self._source.seek(float(times[min(max(index, 0), len(times) - 1)]))
                return
            playhead = self._start_playhead()
            if playhead is not None:
                playhead.step(count, time.monotonic())

    def set_speed(self, speed: float) -> None:
        """Set the simulated time per wall time of the replay."""
        with self._lock:
            if self._playhead is not None:
                self._playhead.set_speed(speed, time.monotonic())

    def _start_playhead(self) -> Playhead | None:
        """The playhead; if live, a new one at the end of the clip, as fast as the source."""
        clip = self.clip
        if self._playhead is None and clip is not None:
            self._playhead = Playhead(clip, clip.duration, self._source.status.real_time_factor)
        self._held = None
        return self._playhead


def _missing(simulated: float, first: float, last: float, is_cut: bool) -> str:
    """Why a time, s, is not shown, of a run that is kept from ``first`` to ``last`` s; empty if it
    is shown. ``is_cut``: whether older frames were dropped.
    """
    kept = f'This run is kept from {first:.2f} to {last:.2f} s'
    if simulated < first and is_cut:
        return f'{kept}; what is older made room, as {MAX_FRAMES} ticks or 40 MB are kept'
    if simulated < first and first > 0:
        return f'{kept}; the page was opened then'
    return kept if not first <= simulated <= last + 1e-6 else ''
