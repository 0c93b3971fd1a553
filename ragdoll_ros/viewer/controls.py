"""Buttons and keys: pushes, time, scene."""
from __future__ import annotations

import asyncio
from collections.abc import Callable

import viser

from ..files.config import scene_names
from ..model.errors import RagdollError
from ..physics.engine.registry import ENGINES
from .push_keys import PushKeys
from .sources.source import Report, Source

PACES = (0.05, 2.0)
"""Slowest and fastest of the slider."""

OTHER = '(other)'
"""Stands for a scene that has no name in config/."""

class Controls:
    """The panel's first tab."""

    def __init__(self, server: viser.ViserServer, source: Source) -> None:
        self.source = source
        self.before_step: Callable[[], None] = lambda: None
        """Called before a single tick is asked for."""
        self._shown = Report()
        self._scene_shown = OTHER
        self._loop = server.get_event_loop()
        gui, is_simulated = server.gui, source.recording is None
        self.pushes = PushKeys(server, source)
        self.pause = gui.add_button('Pause', icon='player-pause', hint='Space')
        self.step_button = gui.add_button('Step', icon='player-track-next', disabled=True,
                                          hint='N; while paused; ends editing')
        self.reset = gui.add_button('Reset', icon='player-skip-back', hint='R')
        self.pace = gui.add_slider('Pace', *PACES, step=0.05, initial_value=1.0,
                                   hint='simulated seconds for each second on the wall')
        self.scene = gui.add_dropdown('Scene', (OTHER, *scene_names()), initial_value=OTHER,
                                      visible=is_simulated)
        self.engine = gui.add_dropdown('Engine', ENGINES, initial_value=ENGINES[0],
                                       visible=is_simulated,
                                       hint='what simulates; another one starts anew')
        self.pace.on_update(lambda event: event.client and self.source.set_pace(self.pace.value))
        self.scene.on_update(self._choose)
        self.engine.on_update(self._choose_engine)
        for button, label, key, action in (
                (self.pause, 'Pause, or go on', 'space', self.toggle_pause),
                (self.step_button, 'Step', 'N', self.step),
                (self.reset, 'Reset', 'R', source.reset)):
            command = gui.add_command(label, hotkey=key)
            for trigger in (button.on_click, command.on_trigger):
                trigger(lambda _, action=action: action())

    def toggle_pause(self) -> None:
        """Hold the time, or let it go on."""
        self.source.pause(not self.source.report.paused)

    def step(self) -> None:
        """Make one tick while the time stands."""
        self.before_step()
        self.source.step()

    def show(self, report: Report) -> None:
        """Show how the source does."""
        if report.paused != self._shown.paused:
            self.pause.label = 'Go on' if report.paused else 'Pause'
            self.pause.icon = 'player-play' if report.paused else 'player-pause'
            self.step_button.disabled = not report.paused
        if report.engine != self._shown.engine:
            self._show_engine(report.engine)
        if report.pace != self._shown.pace:
            self.pace.value = min(max(report.pace, PACES[0]), PACES[1])
        self._shown = report

    def show_rest(self, lies: bool) -> None:
        """Invite to another fall once one is over."""
        label = 'Again' if lies else 'Reset'
        if label != self.reset.label:
            self.reset.label, self.reset.color = label, 'green' if lies else None

    def show_scene(self, name: str) -> None:
        """Show which scene it is.

        It is written where `_choose` reads it, in viser's thread: written from another one, it
        could come between a choice that arrives at this moment and its reading, and win.
        """
        self._scene_shown = shown = name if name in self.scene.options else OTHER
        self._loop.call_soon_threadsafe(setattr, self.scene, 'value', shown)

    async def _choose(self, event: viser.GuiEvent) -> None:
        """Load the chosen scene; at once, before the page tells of the one that is shown."""
        name = event.target.value
        if event.client is not None and name != OTHER:
            asyncio.get_running_loop().run_in_executor(None, self._load, name, event.client)

    async def _choose_engine(self, event: viser.GuiEvent) -> None:
        """Take the chosen engine; see _choose."""
        if event.client is not None:
            asyncio.get_running_loop().run_in_executor(
                None, self._take_engine, event.target.value, event.client)

    def _take_engine(self, name: str, client: viser.ClientHandle) -> None:
        self._ask(client, lambda: self.source.take_engine(name),
                  lambda: self._show_engine(self.source.report.engine))

    def _show_engine(self, name: str) -> None:
        shown = name if name in ENGINES else ENGINES[0]
        self._loop.call_soon_threadsafe(setattr, self.engine, 'value', shown)

    def _load(self, name: str, client: viser.ClientHandle) -> None:
        self._ask(client, lambda: self.source.load(name),
                  lambda: self.show_scene(self._scene_shown))

    @staticmethod
    def _ask(client: viser.ClientHandle, change: Callable[[], None],
             take_back: Callable[[], None]) -> None:
        """Ask for a change; where it is refused, take back what the page shows, and say why."""
        try:
            change()
        except RagdollError as error:
            take_back()
            client.add_notification('Refused', str(error), color='red')
