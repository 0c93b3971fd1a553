"""Controls of the first tab: pushes, time, scene and engine."""
from __future__ import annotations

import asyncio
from collections.abc import Callable

import numpy as np
import viser

from ..files.config import scene_names
from ..model.errors import RagdollError
from ..physics.engine.registry import ENGINES
from .pushing.push_keys import PushKeys
from .sources.source import Frame, Source, SourceStatus

REAL_TIME_FACTORS = (0.05, 2.0)
"""Smallest and largest of the slider."""

FIRST_SCENES = {'Doll': 'drop', 'Person': 'man_faints', 'Hair': 'ponytail', 'Crowd': 'crowd'}
"""Scenes to begin with, one click away, by the labels of their buttons."""

OTHER = '(other)'
"""Stands for a scene that is not in config/."""

REST_TOLERANCE = 0.002
"""m that a bone at rest may drift; one that is about to fall moves farther within REST_PERIOD."""

REST_PERIOD = 1.0
"""s without motion after which a fall is over."""


class Controls:
    """Widgets in the GUI container that is current."""

    def __init__(self, server: viser.ViserServer, source: Source) -> None:
        self.source = source
        self.before_step: Callable[[], None] = lambda: None
        """Called before a single tick is requested."""
        self._shown = SourceStatus()
        self._shown_scene = OTHER
        self._rest_positions: np.ndarray | None = None
        self._rest_since = 0.0
        self._loop = server.get_event_loop()
        gui, is_simulated = server.gui, source.recording is None
        self.pushes = PushKeys(server, source)
        self.pause = gui.add_button('Pause', icon='player-pause', hint='Space')
        self.step_button = gui.add_button('Step', icon='player-track-next', disabled=True,
                                          hint='N; while paused; ends editing')
        self.reset = gui.add_button('Reset', icon='player-skip-back', hint='R')
        self.real_time_factor = gui.add_slider(
            'Real-time factor', *REAL_TIME_FACTORS, step=0.05, initial_value=1.0,
            hint='simulated time per wall time')
        self.scene = gui.add_dropdown('Scene', (OTHER, *scene_names()), initial_value=OTHER,
                                      visible=is_simulated)
        self.first_scenes = gui.add_button_group(
            'Try', tuple(FIRST_SCENES), visible=is_simulated, hint='the default doll, a man who '
            'faints, a doll with hair, ten dolls')
        self.engine = gui.add_dropdown('Engine', ENGINES, initial_value=ENGINES[0],
                                       visible=is_simulated,
                                       hint='physics engine; another one restarts the scene')
        self.real_time_factor.on_update(self._on_real_time_factor)
        self.scene.on_update(self._on_scene)
        self.first_scenes.on_click(self._on_first_scene)
        self.engine.on_update(self._on_engine)
        for button, label, key, action in (
                (self.pause, 'Pause or resume', 'space', self.toggle_pause),
                (self.step_button, 'Step', 'N', self.step),
                (self.reset, 'Reset', 'R', source.reset)):
            command = gui.add_command(label, hotkey=key)
            for trigger in (button.on_click, command.on_trigger):
                trigger(lambda _, action=action: action())

    def toggle_pause(self) -> None:
        """Pause or resume."""
        self.source.pause(not self.source.status.paused)

    def step(self) -> None:
        """Advance by one tick while paused."""
        self.before_step()
        self.source.step()

    def show(self, status: SourceStatus) -> None:
        """Show the status of the source."""
        if status.paused != self._shown.paused:
            self.pause.label = 'Resume' if status.paused else 'Pause'
            self.pause.icon = 'player-play' if status.paused else 'player-pause'
            self.step_button.disabled = not status.paused
        if status.engine != self._shown.engine:
            self._show_engine(status.engine)
        if status.real_time_factor != self._shown.real_time_factor:
            lowest, highest = REAL_TIME_FACTORS
            self.real_time_factor.value = min(max(status.real_time_factor, lowest), highest)
        self._shown = status

    def show_rest(self, frame: Frame, paused: bool, now: float) -> None:
        """Label the reset button 'Again' once a fall is over; ``now``: s of a steady clock."""
        positions, last = frame.state.positions, self._rest_positions
        if (paused or last is None or positions.shape != last.shape
                or not np.abs(positions - last).max() <= REST_TOLERANCE):
            self._rest_since, self._rest_positions = now, positions
        is_at_rest = now - self._rest_since >= REST_PERIOD
        label = 'Again' if is_at_rest else 'Reset'
        if label != self.reset.label:
            self.reset.label, self.reset.color = label, 'green' if is_at_rest else None

    def show_scene(self, name: str) -> None:
        """Show the name of the scene.

        It is set in viser's thread, where `_on_scene` reads it: set from another one, it could
        overwrite a choice that arrives at this moment before that is read.
        """
        self._shown_scene = shown = name if name in self.scene.options else OTHER
        self._loop.call_soon_threadsafe(setattr, self.scene, 'value', shown)

    def _on_real_time_factor(self, event: viser.GuiEvent) -> None:
        """Set it; ignore the 0 of 0.5 as it is typed."""
        lowest, highest = REAL_TIME_FACTORS
        factor = event.target.value
        if event.client is not None and lowest <= factor <= highest:
            self.source.set_real_time_factor(factor)

    async def _on_scene(self, event: viser.GuiEvent) -> None:
        """Load the chosen scene, whose name is read before the page can overwrite it."""
        name = event.target.value
        if name != OTHER:
            self._try(event.client, lambda: self.source.load(name),
                      lambda: self.show_scene(self._shown_scene))

    async def _on_first_scene(self, event: viser.GuiEvent) -> None:
        """Load the scene of a button."""
        name = FIRST_SCENES[event.target.value]
        self._try(event.client, lambda: self.source.load(name),
                  lambda: self.show_scene(self._shown_scene))

    async def _on_engine(self, event: viser.GuiEvent) -> None:
        """Set the chosen engine; see _on_scene."""
        name = event.target.value
        self._try(event.client, lambda: self.source.set_engine(name),
                  lambda: self._show_engine(self.source.status.engine))

    def _show_engine(self, name: str) -> None:
        shown = name if name in ENGINES else ENGINES[0]
        self._loop.call_soon_threadsafe(setattr, self.engine, 'value', shown)

    @staticmethod
    def _try(client: viser.ClientHandle | None, change: Callable[[], None],
             revert: Callable[[], None]) -> None:
        """Make a user's change in another thread; if it is refused, revert the page and notify."""
        def run() -> None:
            try:
                change()
            except RagdollError as error:
                revert()
                client.add_notification('Refused', str(error), color='red')

        if client is not None:
            asyncio.get_running_loop().run_in_executor(None, run)
