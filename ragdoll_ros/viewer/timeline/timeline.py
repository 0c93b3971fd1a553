"""The timeline in the panel: the last minute of what was shown, to be looked at again and saved."""
from __future__ import annotations

import importlib.util
import threading
import time

import viser

from ..browser.client_events import tell
from ..sources.source import Frame, Source
from .export_zip import zipped
from .frame_buffer import Cut, History, cut_of
from .playhead import Look
from .strip import strip

PERIOD = 0.5
"""s between two updates of the panel while frames come."""

STEP = 0.001
"""s: the slider's. Between two ticks it shows the first."""

SPEEDS = {'1': 1.0, '1/2': 0.5, '1/4': 0.25, '1/10': 0.1, '1/50': 0.02}
"""s of the run in each s on the wall, by their names."""

BACK, PLAY, FORTH, LIVE = '<', 'Play', '>', 'Live'

TYPING, NO_MORE = 'typing', 'no more'
"""What pages tell when one begins to type a time, and when that is over."""

FOCUS = f"""
    document.addEventListener('focusin', (event) => {{
      if (isTyped(event.target)) tell('{TYPING}');
    }});
    document.addEventListener('focusout', (event) => {{
      if (isTyped(event.target)) tell('{NO_MORE}');
    }});"""
"""For told.py."""

CAN_WRITE_MCAP = importlib.util.find_spec('mcap') is not None


class Timeline:
    """`take` keeps what the source shows; `shown` is what the page is to draw in its place.

    What is looked at is a cut: frames that were here already, so that nothing is asked of the
    source, which goes on. A reset, or another scene, leads back to what goes on.
    """

    def __init__(self, server: viser.ViserServer, source: Source) -> None:
        self._history = History()
        self._look: Look | None = None
        self._whole: Cut | None = None
        self._held: Look | None = None
        """The look back that began with a click into the field of the time, until one goes on."""
        self._holder: int | None = None
        """The page where that was."""
        self._next = 0.0
        self._again = False
        """Whether the slider is to be sent though it seems to be where it should."""
        self._lock = threading.RLock()
        self._loop = server.get_event_loop()
        if source.recording is not None:
            self._whole = cut_of(source.recording, source.frame_at)
        gui = server.gui
        with gui.add_folder('Timeline', expand_by_default=True):
            self.slider = gui.add_slider('Time', 0.0, 1.0, STEP, 0.0, hint='s; drag to look back: '
                                         'what goes on goes on')
            self.strip = gui.add_html('')
            self.typing = tell(gui, 'time', FOCUS, self._typing, self.slider)
            self.buttons = gui.add_button_group(
                'Look', (BACK, PLAY, FORTH, LIVE),
                hint='J, K, L: a frame back, play or stand, a frame on; Live: what goes on')
            self.speed = gui.add_dropdown('Speed', tuple(SPEEDS), initial_value='1')
            self.save = gui.add_button('Save this', icon=viser.Icon.DOWNLOAD,
                                       hint='All of the timeline as run.zip: MCAP, glTF, BVH, CSV')
        self.slider.on_update(self._slid)
        self.buttons.on_click(lambda event: self._press(event.target.value))
        self.speed.on_update(lambda _: self._set_speed())
        self.save.on_click(self._send)
        for label, key, button in (('A frame back', 'J', BACK), ('Play, or stand', 'K', PLAY),
                                   ('A frame on', 'L', FORTH)):
            command = gui.add_command(label, hotkey=key)
            command.on_trigger(lambda _, button=button: self._press(button))

        @server.on_client_disconnect
        def _(client: viser.ClientHandle) -> None:
            self._typing(client.client_id, NO_MORE)

    @property
    def is_live(self) -> bool:
        """Whether what goes on is shown."""
        return self._look is None

    @property
    def cut(self) -> Cut | None:
        """What the timeline spans now; None before the first frame."""
        with self._lock:
            if self._look is not None:
                return self._look.cut
            return self._whole or (self._history.cut() if len(self._history) else None)

    def take(self, frame: Frame) -> None:
        """Keep a frame of the source, a new one."""
        with self._lock:
            if self._whole is not None:
                return
            moment = self._history.take(frame)
            if self._look is not None and moment is not None and (
                    moment.begins or frame.scene is not self._look.cut.frame(0).scene):
                self._look = None

    def shown(self, live: Frame, now: float) -> Frame:
        """The frame that is to be drawn at ``now`` s of a steady clock."""
        with self._lock:
            look = self._look
            frame = live if look is None else look.frame(now)
            if now >= self._next:
                self._next = now + PERIOD
                self._tell(live, now)
        return frame

    def instant(self, live: Frame) -> float:
        """Where on the timeline the source's newest frame is, s."""
        return live.time if self._whole is not None else self._history.end

    def looked_at(self, now: float) -> float | None:
        """Instant that is shown, as History counts, s; None for what goes on."""
        with self._lock:
            look = self._look
            return None if look is None else look.cut.times[0] + look.time(now)

    def go_to(self, instant: float) -> None:
        """Look at ``instant`` s of the timeline, as the slider has it."""
        with self._lock:
            now = time.monotonic()
            if self._look is None:
                # Where it was meanwhile on its way to the page, the page shows another place.
                self._again, self._next = True, now + PERIOD
            look = self._begin()
            if look is not None:
                look.go_to(instant, now)

    async def _slid(self, event: viser.GuiEvent) -> None:
        """Go where the slider was put, or what was typed: in viser's thread, where `_move` acts."""
        if event.client is not None:
            self.go_to(event.target.value)

    def _typing(self, page: int, what: str) -> None:
        """Stand while one types a time; go on with what goes on if nothing came of it."""
        with self._lock:
            if what == TYPING:
                self._holder = page
                was_live = self._look is None
                self.go_to(self.slider.value)
                if self._look is not None:
                    self._look.plays = False
                self._held = self._look if was_live else None
                self._again = False
            elif page == self._holder and self._held is self._look:
                self._look = None

    def _begin(self) -> Look | None:
        """The look back, begun at the end of what there is if there is none yet."""
        cut = self.cut
        if self._look is None and cut is not None:
            self._look = Look(cut, cut.duration, SPEEDS[self.speed.value])
        self._held = None
        return self._look

    def _press(self, button: str) -> None:
        now = time.monotonic()
        with self._lock:
            self._next = 0.0
            if button == LIVE:
                self._look = None
                return
            look = self._begin()
            if look is not None and button == PLAY:
                look.toggle(now)
            elif look is not None:
                look.step(1 if button == FORTH else -1, now)

    def _set_speed(self) -> None:
        with self._lock:
            if self._look is not None:
                self._look.set_speed(SPEEDS[self.speed.value], time.monotonic())

    def _tell(self, live: Frame, now: float) -> None:
        """Show in the panel where it is."""
        cut, look = self.cut, self._look
        if cut is None:
            return
        at = look.time(now) if look is not None else live.time if self._whole else cut.duration
        longest = max(round(cut.duration, 3), STEP)
        if look is None or self.slider.max != longest:
            for handle, key, value in ((self.slider, 'max', longest),
                                       (self.strip, 'content', strip(cut))):
                if getattr(handle, key) != value:
                    setattr(handle, key, value)
        self._loop.call_soon_threadsafe(self._move, round(min(at, longest), 3), look, self._again)
        self._again = False

    def _move(self, at: float, look: Look | None, again: bool) -> None:
        """Put the slider at ``at`` s, unless it has been put elsewhere meanwhile.

        In viser's thread: written from another one, it could come between what a page sends and
        its reading, and win.
        """
        # A slider that is being dragged is where the look is, but for its step.
        if look is not self._look or (abs(self.slider.value - at) <= STEP and not again):
            return
        if again:
            # Viser sends nothing that it holds to be there already.
            self.slider.value = at + STEP
        self.slider.value = at

    def _send(self, event: viser.GuiEvent) -> None:
        """Send all of the timeline to the page that asked."""
        cut = self.cut
        if cut is None or event.client is None:
            return
        content = zipped(cut.recording(), 'run', lambda suffix: CAN_WRITE_MCAP or suffix != '.mcap')
        event.client.send_file_download('run.zip', content, save_immediately=True)
