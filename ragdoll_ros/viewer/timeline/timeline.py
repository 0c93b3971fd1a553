"""The timeline in the panel: scrubs through the last minute that was shown, and exports it."""
from __future__ import annotations

import importlib.util
import threading
import time

import viser

from ..browser.client_events import add_listener
from ..sources.source import Frame, Source
from .export_zip import export_zip
from .frame_buffer import Clip, FrameBuffer, clip_of
from .playhead import Playhead
from .strip import strip

PERIOD = 0.5
"""s between two updates of the panel while frames come."""

STEP = 0.001
"""s: of the slider. Between two ticks the earlier one is shown."""

SPEEDS = {'1': 1.0, '1/2': 0.5, '1/4': 0.25, '1/10': 0.1, '1/50': 0.02}
"""s of the clip per s of wall time, by their labels."""

BACK, PLAY, FORWARD, LIVE = '<', 'Play', '>', 'Live'

FOCUS, BLUR = 'focus', 'blur'
"""Events of slider_focus.js."""

CAN_WRITE_MCAP = importlib.util.find_spec('mcap') is not None


class Timeline:
    """Keeps the source's frames with `add`; `frame_to_show` is what the page draws instead.

    Past frames come from a buffer: the source is not involved and continues. A reset or another
    scene returns to the live frames.
    """

    def __init__(self, server: viser.ViserServer, source: Source) -> None:
        self._buffer = FrameBuffer()
        self._playhead: Playhead | None = None
        """None: live."""
        self._recorded: Clip | None = None
        """The whole of a recording; None for other sources."""
        self._typing: Playhead | None = None
        """The playhead that focusing the number field created, until it is used."""
        self._typing_client: int | None = None
        self._next_update = 0.0
        self._resend = False
        """Whether to send the slider's value even if it has not changed."""
        self._lock = threading.RLock()
        self._loop = server.get_event_loop()
        if source.recording is not None:
            self._recorded = clip_of(source.recording, source.frame_at)
        gui = server.gui
        with gui.add_folder('Timeline', expand_by_default=True):
            self.slider = gui.add_slider('Time', 0.0, 1.0, STEP, 0.0, hint='s; drag to look back: '
                                         'the simulation continues')
            self.strip = gui.add_html('')
            self.focus_events = add_listener(gui, 'time', 'slider_focus.js', self._on_focus,
                                             self.slider)
            self.buttons = gui.add_button_group(
                'Playback', (BACK, PLAY, FORWARD, LIVE),
                hint='J, K, L: previous frame, play or pause, next frame; Live: the newest frame')
            self.speed = gui.add_dropdown('Speed', tuple(SPEEDS), initial_value='1')
            self.export = gui.add_button('Export', icon=viser.Icon.DOWNLOAD, hint='the whole '
                                         'timeline as run.zip: MCAP, glTF, BVH, CSV')
        self.slider.on_update(self._on_slider)
        self.buttons.on_click(lambda event: self._press(event.target.value))
        self.speed.on_update(lambda _: self._set_speed())
        self.export.on_click(self._send_export)
        for label, key, button in (('Previous frame', 'J', BACK), ('Play or pause', 'K', PLAY),
                                   ('Next frame', 'L', FORWARD)):
            command = gui.add_command(label, hotkey=key)
            command.on_trigger(lambda _, button=button: self._press(button))

        @server.on_client_disconnect
        def _(client: viser.ClientHandle) -> None:
            self._on_focus(client.client_id, BLUR)

    @property
    def is_live(self) -> bool:
        """Whether the newest frame is shown."""
        return self._playhead is None

    @property
    def clip(self) -> Clip | None:
        """What the timeline spans now; None before the first frame."""
        with self._lock:
            if self._playhead is not None:
                return self._playhead.clip
            return self._recorded or (self._buffer.clip() if len(self._buffer) else None)

    def add(self, frame: Frame) -> None:
        """Keep a new frame of the source."""
        with self._lock:
            if self._recorded is not None:
                return
            entry = self._buffer.add(frame)
            if self._playhead is not None and entry is not None and (
                    entry.resets or frame.scene is not self._playhead.clip.frame(0).scene):
                self._playhead = None

    def frame_to_show(self, live: Frame, now: float) -> Frame:
        """The frame to draw at ``now`` s of a steady clock."""
        with self._lock:
            playhead = self._playhead
            frame = live if playhead is None else playhead.frame(now)
            if now >= self._next_update:
                self._next_update = now + PERIOD
                self._update_panel(live, now)
        return frame

    def live_instant(self, live: Frame) -> float:
        """Instant of the source's newest frame on the timeline, s."""
        return live.time if self._recorded is not None else self._buffer.end

    def shown_instant(self, now: float) -> float | None:
        """Instant that is shown, s of the timeline; None if live."""
        with self._lock:
            playhead = self._playhead
            return None if playhead is None else playhead.clip.times[0] + playhead.time(now)

    def go_to(self, time_: float) -> None:
        """Show ``time_`` s of the clip, as the slider counts."""
        with self._lock:
            now = time.monotonic()
            if self._playhead is None:
                # A slider value on its way to the page would overwrite the user's one there.
                self._resend, self._next_update = True, now + PERIOD
            playhead = self._start_playhead()
            if playhead is not None:
                playhead.go_to(time_, now)

    async def _on_slider(self, event: viser.GuiEvent) -> None:
        """Go where a user put the slider: in viser's thread, as `_move_slider`."""
        if event.client is not None:
            self.go_to(event.target.value)

    def _on_focus(self, client: int, event: str) -> None:
        """Pause while a user types a time; become live again if nothing was entered."""
        with self._lock:
            if event == FOCUS:
                self._typing_client = client
                was_live = self._playhead is None
                self.go_to(self.slider.value)
                if self._playhead is not None:
                    self._playhead.is_playing = False
                self._typing = self._playhead if was_live else None
                self._resend = False
            elif client == self._typing_client and self._typing is self._playhead:
                self._playhead = None

    def _start_playhead(self) -> Playhead | None:
        """The playhead; if live, a new one at the end of the clip."""
        clip = self.clip
        if self._playhead is None and clip is not None:
            self._playhead = Playhead(clip, clip.duration, SPEEDS[self.speed.value])
        self._typing = None
        return self._playhead

    def _press(self, button: str) -> None:
        now = time.monotonic()
        with self._lock:
            self._next_update = 0.0
            if button == LIVE:
                self._playhead = None
                return
            playhead = self._start_playhead()
            if playhead is not None and button == PLAY:
                playhead.toggle(now)
            elif playhead is not None:
                playhead.step(1 if button == FORWARD else -1, now)

    def _set_speed(self) -> None:
        with self._lock:
            if self._playhead is not None:
                self._playhead.set_speed(SPEEDS[self.speed.value], time.monotonic())

    def _update_panel(self, live: Frame, now: float) -> None:
        """Show the clip's range and events, and the shown time."""
        clip, playhead = self.clip, self._playhead
        if clip is None:
            return
        shown = (playhead.time(now) if playhead is not None
                 else live.time if self._recorded else clip.duration)
        end = max(round(clip.duration, 3), STEP)
        if playhead is None or self.slider.max != end:
            for handle, key, value in ((self.slider, 'max', end),
                                       (self.strip, 'content', strip(clip))):
                if getattr(handle, key) != value:
                    setattr(handle, key, value)
        self._loop.call_soon_threadsafe(self._move_slider, round(min(shown, end), 3), playhead,
                                        self._resend)
        self._resend = False

    def _move_slider(self, value: float, playhead: Playhead | None, resend: bool) -> None:
        """Set the slider, s, unless the user has moved it meanwhile.

        In viser's thread: set from another one, it could overwrite a value that a page sent before
        that is read.
        """
        # While a user drags the slider, the playhead is where the slider is, to within its step.
        if playhead is not self._playhead or (abs(self.slider.value - value) <= STEP
                                              and not resend):
            return
        if resend:
            # Viser does not send a value that equals the last one.
            self.slider.value = value + STEP
        self.slider.value = value

    def _send_export(self, event: viser.GuiEvent) -> None:
        """Send the whole timeline to the page that asked for it."""
        clip = self.clip
        if clip is None or event.client is None:
            return
        content = export_zip(clip.recording(), 'run',
                             lambda suffix: CAN_WRITE_MCAP or suffix != '.mcap')
        event.client.send_file_download('run.zip', content, save_immediately=True)
