"""Pushes by arrow keys and buttons; a slider sets their force."""
from __future__ import annotations

import threading
import time

import viser

from ..model.scene import Scene
from ..realtime.arrow_keys import FORCE, TAP, PressedKeys, total_force
from .browser.client_events import add_listener
from .sources.source import Source

ARROWS = {'←': 'left', '↑': 'up', '↓': 'down', '→': 'right'}
"""By the labels of their buttons, short enough for one row."""

STRENGTHS = (100.0, 5000.0)
"""N: smallest and largest of the slider."""

STEP = 50.0
"""N: of the slider."""

EFFECT_DURATION = 0.1
"""s of the push whose effect the page shows."""

REPEAT_PERIOD = 0.04
"""s between two pushes of a held key, well below the node's push_timeout."""

REPEAT_DURATION = 0.1
"""s of simulated time that each of them lasts, unless the next one replaces it."""


class PushKeys:
    """Buttons, keys and a slider that push, in the GUI container that is current.

    They are hidden for a recording, which cannot be pushed.
    """

    def __init__(self, server: viser.ViserServer, source: Source) -> None:
        self._source = source
        self._lock = threading.Lock()
        self._pressed: dict[int, PressedKeys] = {}
        self._mass = 0.0
        self._next_repeat = 0.0
        self._is_pushing = False
        gui, can_push = server.gui, source.recording is None
        self.key_events = add_listener(gui, 'keys', 'arrow_keys.js', lambda page, down: self.take(
            page, down.split(), time.monotonic()))
        buttons = gui.add_button_group(
            'Push', tuple(ARROWS), visible=can_push, hint='as seen from the front: left, away from '
            'you, towards you, right; arrow keys do the same, and repeat while held')
        self.strength = gui.add_slider('Strength, N', *STRENGTHS, step=STEP,
                                       initial_value=FORCE, visible=can_push, hint='of a push')
        self._effect = gui.add_html('', visible=can_push)
        self.strength.on_update(lambda _: self._show_effect())
        buttons.on_click(lambda event: self.tap(ARROWS[event.target.value]))
        for arrow in ARROWS.values() if can_push else ():
            command = gui.add_command(f'Push {arrow}')
            command.on_trigger(lambda _, arrow=arrow: self.tap(arrow))

        @server.on_client_disconnect
        def _(client: viser.ClientHandle) -> None:
            with self._lock:
                self._pressed.pop(client.client_id, None)

    def tap(self, arrow: str) -> None:
        """Push for the duration of a tap."""
        self._source.push(total_force([arrow], self.strength.value), TAP)

    def take(self, page: int, down: list[str], now: float) -> None:
        """Set which arrow keys are down on a page; a new one pushes for at least a tap."""
        with self._lock:
            pressed = self._pressed.setdefault(page, PressedKeys())
            if pressed.report(down, now):
                self._source.push(total_force(self._arrows_at(now), self.strength.value), TAP)

    def update(self, now: float) -> None:
        """Repeat the pushes of held keys, and end them on release; call repeatedly."""
        with self._lock:
            held = any(each.held(now) for each in self._pressed.values())
            if held and now >= self._next_repeat:
                self._next_repeat = now + REPEAT_PERIOD
                self._source.push(total_force(self._arrows_at(now), self.strength.value),
                                  REPEAT_DURATION)
            elif self._is_pushing and not held:
                self._source.push((0.0, 0.0, 0.0), TAP)
            self._is_pushing = held

    def show_scene(self, scene: Scene) -> None:
        """Show the effect of a push on the first doll of a scene."""
        self._mass = sum(bone.mass for bone in scene.bones[scene.bone_slices[0]])
        self._show_effect()

    def _arrows_at(self, now: float) -> list[str]:
        return [arrow for each in self._pressed.values() for arrow in each.active(now)]

    def _show_effect(self) -> None:
        force = self.strength.value
        self._effect.content = '' if not self._mass else (
            '<div style="font-size: 0.85em; padding: 0 1em 0.4em">'
            f'{force:g} N for {EFFECT_DURATION:g} s give {self._mass:.3g} kg '
            f'{force * EFFECT_DURATION / self._mass:.2g} m/s, a tap '
            f'{force * TAP / self._mass:.2g} m/s</div>')
