"""Controls of the first tab: pushes, scene and engine."""
from __future__ import annotations

import asyncio
from collections.abc import Callable

import viser

from ..files.config import scene_names
from ..model.errors import RagdollError
from ..model.scene import Scene
from ..physics.engine.registry import ENGINES
from .pushing.ball import BallThrower
from .pushing.push_keys import PushKeys
from .sources.source import Frame, Source, SourceStatus
from .user_actions import UserActions

FIRST_SCENES = {'Doll': 'drop', 'Person': 'man_faints', 'Skin': 'character_falls',
                'Hair': 'ponytail', 'Crowd': 'crowd'}
"""Scenes to begin with, one click away, by the labels of their buttons."""

OTHER = '(other)'
"""Stands for a scene that is not in config/."""


class Controls:
    """Widgets in the GUI container that is current."""

    def __init__(self, server: viser.ViserServer, source: Source, actions: UserActions) -> None:
        self.source, self._actions = source, actions
        self.loading = ''
        """Name of the scene that is being loaded; empty if none is."""
        self.before_load: Callable[[], None] = lambda: None
        """Called before another scene is loaded."""
        self._shown_engine = ''
        self._shown_scene = OTHER
        self._run: tuple[Scene, int] | None = None
        """Scene and number of the run of the newest frame."""
        self._loop = server.get_event_loop()
        gui, is_simulated = server.gui, source.recording is None
        self.pushes = PushKeys(server, source, actions)
        self.ball = BallThrower(server, source)
        self.go_limp = gui.add_button(
            'Go limp', visible=False, hint='End animations and motors: the doll falls, from its '
            'pose and with its velocities')
        self.go_limp.on_click(self._on_go_limp)
        self.motor_strength = gui.add_slider(
            'Motor strength', 0.0, 1.0, step=0.01, initial_value=1.0, visible=False,
            hint='Share of stiffness, damping and largest torque that all motors have; at 0 the '
            'doll is limp')
        self.motor_strength.on_update(self._on_motor_strength)
        self.scene = gui.add_dropdown('Scene', (OTHER, *scene_names()), initial_value=OTHER,
                                      visible=is_simulated)
        self.first_scenes = gui.add_button_group(
            'Try', tuple(FIRST_SCENES), visible=is_simulated, hint='The default doll, a man who '
            'faints, a character with a skin, a doll with hair, ten dolls; more: the tab Scenes')
        self.engine = gui.add_dropdown('Engine', ENGINES, initial_value=ENGINES[0],
                                       visible=is_simulated,
                                       hint='Physics engine; another one restarts the scene')
        self.scene.on_update(self._on_scene)
        self.first_scenes.on_click(self._on_first_scene)
        self.engine.on_update(self._on_engine)

    def show(self, status: SourceStatus) -> None:
        """Show the status of the source."""
        if status.engine != self._shown_engine:
            self._shown_engine = status.engine
            self._show_engine(status.engine)

    def show_animated(self, scene: Scene) -> None:
        """Show the button that ends animations and motors, and the slider of motors, if the scene
        has any.
        """
        is_simulated, dolls = self.source.recording is None, scene.dolls
        self.go_limp.visible = is_simulated and any(
            placement.animation or placement.motors for placement in dolls)
        self.motor_strength.visible = is_simulated and any(
            placement.motors for placement in dolls)

    def add(self, frame: Frame) -> None:
        """Take note of a new frame: at the start of a run motors have their scene's strength."""
        if self._run is not None and self._run[0] is frame.scene and self._run[1] == frame.run:
            return
        self._run = frame.scene, frame.run
        strengths = [each.motors.strength for each in frame.scene.dolls if each.motors is not None]
        if strengths:
            self._loop.call_soon_threadsafe(
                setattr, self.motor_strength, 'value', max(strengths))

    def show_scene(self, name: str) -> None:
        """Show the name of the scene.

        The name is set in viser's thread, where `_on_scene` reads it. Set in another thread, it
        could overwrite a user's choice that has arrived but has not been read.
        """
        self._shown_scene = shown = name if name in self.scene.options else OTHER
        self._loop.call_soon_threadsafe(setattr, self.scene, 'value', shown)

    def load(self, client: viser.ClientHandle | None, name: str) -> None:
        """Load a scene for a page; to be called in viser's thread."""
        def load() -> None:
            self.loading = name
            self.before_load()
            try:
                self.source.load(name)
            finally:
                self.loading = ''

        self._try(client, load, lambda: self.show_scene(self._shown_scene))

    async def _on_go_limp(self, _: viser.GuiEvent) -> None:
        """End animations and motors."""
        self._actions.run(self.source.go_limp)

    async def _on_motor_strength(self, event: viser.GuiEvent) -> None:
        """Set the strength that a page has chosen, which is read before a reset changes it."""
        if event.client is not None:
            self._actions.run(self.source.set_strength, event.target.value)

    async def _on_scene(self, event: viser.GuiEvent) -> None:
        """Load the chosen scene, whose name is read before the page can overwrite it."""
        name = event.target.value
        if name != OTHER:
            self.load(event.client, name)

    async def _on_first_scene(self, event: viser.GuiEvent) -> None:
        """Load the scene of a button."""
        self.load(event.client, FIRST_SCENES[event.target.value])

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
