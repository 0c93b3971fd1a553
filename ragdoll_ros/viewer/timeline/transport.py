"""The transport bar below the picture: play, step, reset, speed, time, and what is shown."""
from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import viser

from ..browser.scripts import add_listener
from ..browser.scripts import source as script_source
from ..sources.source import REAL_TIME_FACTORS, Frame, Source, SourceStatus
from ..user_actions import UserActions
from ..viser_internals import run_script
from .rest import Rest
from .strip import strip
from .timeline import Timeline

PERIOD = 0.5
"""s between two updates of time and strip while they advance; pages extrapolate the time."""

IN_THE_PAST = 'This is the past: keys and drags act on the live picture. Press Live.'

SHOW = 'window.ragdollShow?.(Object.assign(window.ragdollTransport ??= {}, %s));'
"""Keeps what has changed, and shows it if the bar is there; see transport.js."""


@dataclass(frozen=True)
class Shown:
    """What the bars of all pages show."""

    live: bool
    """Whether the newest frame is shown."""
    recorded: bool
    """Whether it is a recording, which has nothing newer."""
    playing: bool
    resting: bool
    """Whether a fall is over."""
    loading: str
    """Name of the scene that is being loaded; empty if none is."""
    time: float
    """Simulated time of the shown frame, s."""
    position: float
    """Of the shown instant on the timeline, s."""
    duration: float
    """Of the timeline, s."""
    speed: float
    rate: float
    """Simulated time per wall time that has been reached."""
    strip: str
    """Events of the timeline, as SVG."""


class Transport:
    """The bar of all pages, its keys, and what they do."""

    def __init__(self, server: viser.ViserServer, source: Source, timeline: Timeline,
                 actions: UserActions) -> None:
        self._server, self._source, self._timeline = server, source, timeline
        self.before_step: Callable[[], None] = lambda: None
        """Called before a single tick is requested."""
        self.loading: Callable[[], str] = lambda: ''
        """Name of the scene that is being loaded; empty if none is."""
        self.shown: Shown | None = None
        """None before the first frame."""
        self._sent: dict[int, dict[str, object]] = {}
        """What each page shows."""
        self._rest = Rest()
        self._updated = 0.0
        gui = server.gui
        self.events = add_listener(gui, 'transport', 'transport.js', lambda page, text: actions.run(
            self._act, page, text), STYLE=script_source('transport.css'))
        for label, key, action in (('Play or pause', 'space', self.toggle),
                                   ('Step', 'N', self.step), ('Step back', 'B', self.step_back),
                                   ('Reset', 'R', source.reset), ('Live', 'L', timeline.go_live)):
            command = gui.add_command(label, hotkey=key)
            command.on_trigger(actions.callback(lambda _, action=action: action()))

        @server.on_client_disconnect
        def _(client: viser.ClientHandle) -> None:
            self._sent.pop(client.client_id, None)
            timeline.release(client.client_id)

    def toggle(self) -> None:
        """Pause or resume what is shown: the source, or the replay."""
        if self._timeline.is_live:
            self._source.pause(not self._source.status.paused)
        else:
            self._timeline.toggle()

    def step(self) -> None:
        """Advance by one tick while paused, or show the next frame of the past."""
        if self._source.recording is not None or not self._timeline.is_live:
            self._timeline.step(1)
        else:
            self.before_step()
            self._source.step()

    def step_back(self) -> None:
        """Show the frame before."""
        self._timeline.step(-1)

    def set_speed(self, speed: float) -> None:
        """Set the simulated time per wall time of what is shown; ignore impossible ones."""
        lowest, highest = REAL_TIME_FACTORS
        if not lowest <= speed <= highest:
            return
        if self._timeline.is_live:
            self._source.set_real_time_factor(speed)
        else:
            self._timeline.set_speed(speed)

    def refuse(self, client: viser.ClientHandle | None) -> None:
        """Tell a page that nothing can be pushed or dragged in the past."""
        if client is not None:
            run_script(client, f'window.ragdollNotice?.({json.dumps(IN_THE_PAST)});')

    def update(self, live: Frame, shown: Frame, status: SourceStatus, now: float) -> None:
        """Show the state and time of the ``shown`` frame, and the events of the timeline.

        ``live`` is the newest frame, ``now`` s of a steady clock.
        """
        timeline, before = self._timeline, self.shown
        playing = not status.paused if timeline.is_live else timeline.is_playing
        changes = {'live': timeline.is_live, 'recorded': self._source.recording is not None,
                   'playing': playing, 'speed': timeline.speed or status.real_time_factor,
                   'resting': self._rest.update(live, status.paused, now),
                   'loading': self.loading()}
        is_due = now >= self._updated + PERIOD
        is_other = before is None or before.live != timeline.is_live
        if is_other or is_due or not playing:
            changes |= {'time': round(shown.time, 3), 'duration': round(timeline.duration, 3),
                        'position': round(timeline.position(live, now), 3),
                        'rate': self._rate(shown, changes['speed'], now)}
        if is_other or (is_due and timeline.is_live and not changes['recorded']):
            changes['strip'] = strip(timeline.clip)
        if is_due:
            self._updated = now
        self.shown = Shown(**changes) if before is None else replace(before, **changes)
        self._send()

    def _rate(self, shown: Frame, speed: float, now: float) -> float:
        """How fast time has advanced since the last update; ``speed`` where it jumped."""
        before = self.shown
        advanced = 0.0 if before is None or not before.playing else shown.time - before.time
        rate = advanced / max(now - self._updated, 1e-9)
        return round(rate, 3) if 0 < rate < speed else speed

    def _send(self) -> None:
        """Send to each page what it does not show yet."""
        values = vars(self.shown)
        for page, client in self._server.get_clients().items():
            sent = self._sent.setdefault(page, {})
            changes = {key: value for key, value in values.items() if sent.get(key) != value}
            if changes:
                sent.update(changes)
                run_script(client, SHOW % json.dumps(changes))

    def _note(self, page: int, text: str) -> None:
        """Show a text at a page's time field; an empty text removes it."""
        client = self._server.get_clients().get(page)
        if client is not None:
            run_script(client, f'window.ragdollTimeNote?.({json.dumps(text)});')

    def _act(self, page: int, text: str) -> None:
        """Do what an event of transport.js names, with a number if it needs one."""
        action, _, number = text.partition(' ')
        actions: dict[str, Callable[[], None]] = {
            'toggle': self.toggle, 'step': self.step, 'back': self.step_back,
            'reset': self._source.reset, 'live': self._timeline.go_live,
            'repeat': lambda: self._sent.pop(page, None),
            'focus': lambda: self._timeline.hold(page),
            'blur': lambda: self._timeline.release(page)}
        values: dict[str, Callable[[float], None]] = {
            'position': self._timeline.go_to, 'speed': self.set_speed,
            'time': lambda time: self._note(page, self._timeline.go_to_time(time))}
        if action in actions:
            actions[action]()
        elif action in values:
            try:
                value = float(number)
            except ValueError:
                return
            if math.isfinite(value):
                values[action](value)
