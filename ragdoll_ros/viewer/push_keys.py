"""Pushes by arrow keys: which are down each page tells, and how hard they push a slider says."""
from __future__ import annotations

import threading
import time

import viser

from ..model.scene import Scene
from ..realtime.arrow_keys import FORCE, TAP, PressedKeys, total_force
from .browser.client_events import tell
from .sources.source import Source

ARROWS = {'←': 'left', '↑': 'up', '↓': 'down', '→': 'right'}
"""Label of each push: short, so that all stand in one row."""

STRENGTHS = (100.0, 5000.0)
"""N: weakest and strongest of the slider."""

STEP = 50.0
"""N between two values of the slider."""

SHOVE = 0.1
"""s for which the page says what a push does."""

REFRESH = 0.04
"""s between two pushes of a held key, well within the node's push_timeout."""

LASTS = 0.1
"""s of simulated time that each of them pushes, unless the next one comes first."""

KEYS = """
    const down = new Set();
    const tellAll = () => tell([...down].join(' '));
    const letGo = () => { if (down.size) { down.clear(); tellAll(); } };
    const root = document.documentElement;
    root.addEventListener('keydown', (event) => {
      const key = event.key.replace('Arrow', '').toLowerCase();
      const arrow = event.key.startsWith('Arrow');
      if (arrow || key === 'e') event.stopPropagation();
      if (!arrow || event.target.matches('input, textarea, select')
          || event.ctrlKey || event.altKey || event.metaKey || down.has(key)) return;
      down.add(key);
      tellAll();
    });
    root.addEventListener('keyup', (event) => {
      if (down.delete(event.key.replace('Arrow', '').toLowerCase())) tellAll();
    });
    window.addEventListener('blur', letGo);
    document.addEventListener('visibilitychange', letGo);
    setInterval(() => { if (down.size) tellAll(); }, 100);
    document.addEventListener('click', (event) => {
      const at = document.activeElement;
      const typed = at?.matches('input:not([type=checkbox]), textarea');
      if (event.detail && (!typed || event.target.closest('[role=option]'))) at?.blur();
    });"""
"""For told.py: tells which arrows are down; again and again while any is, as a page may go without
a word. Arrows and E are kept from viser's camera, which would turn or rise with them; commands
still get E: they listen where this does, the camera further out. What was clicked gives the keys
back, or Space would press it again, a checkbox keep all keys; not so a field in which one types."""


class PushKeys:
    """Buttons, keys and a slider that push, in the GUI container that is current.

    Of a recording, which nothing pushes, there are none to be seen.
    """

    def __init__(self, server: viser.ViserServer, source: Source) -> None:
        self._source = source
        self._lock = threading.Lock()
        self._pressed: dict[int, PressedKeys] = {}
        self._mass = 0.0
        self._next = 0.0
        self._pushing = False
        gui, can_push = server.gui, source.recording is None
        self.told = tell(gui, 'keys', KEYS, lambda page, down: self.take(
            page, down.split(), time.monotonic()))
        buttons = gui.add_button_group(
            'Push', tuple(ARROWS), visible=can_push, hint='as seen from in front of the doll: '
            'left, away, toward you, right; arrow keys do the same, and push on while they are '
            'held')
        self.strength = gui.add_slider('Strength, N', *STRENGTHS, step=STEP,
                                       initial_value=FORCE, visible=can_push, hint='of a push')
        self._effect = gui.add_html('', visible=can_push)
        self.strength.on_update(lambda _: self._tell_effect())
        buttons.on_click(lambda event: self.tap(ARROWS[event.target.value]))
        for arrow in ARROWS.values() if can_push else ():
            command = gui.add_command(f'Push {arrow}')
            command.on_trigger(lambda _, arrow=arrow: self.tap(arrow))

        @server.on_client_disconnect
        def _(client: viser.ClientHandle) -> None:
            with self._lock:
                self._pressed.pop(client.client_id, None)

    def tap(self, arrow: str) -> None:
        """Push for a tap."""
        self._source.push(total_force([arrow], self.strength.value), TAP)

    def take(self, page: int, down: list[str], now: float) -> None:
        """Enter which arrows are down on a page; what goes down pushes for a tap at least."""
        with self._lock:
            pressed = self._pressed.setdefault(page, PressedKeys())
            if pressed.report(down, now):
                self._source.push(total_force(self._at(now), self.strength.value), TAP)

    def keep(self, now: float) -> None:
        """Push on with what is held, and end the push of what no longer is; called at each turn."""
        with self._lock:
            held = any(each.held(now) for each in self._pressed.values())
            if held and now >= self._next:
                self._next = now + REFRESH
                self._source.push(total_force(self._at(now), self.strength.value), LASTS)
            elif self._pushing and not held:
                self._source.push((0.0, 0.0, 0.0), TAP)
            self._pushing = held

    def show_scene(self, scene: Scene) -> None:
        """Say from now on what a push does to the first doll of a scene."""
        self._mass = sum(bone.mass for bone in scene.bones[scene.bone_slices[0]])
        self._tell_effect()

    def _at(self, now: float) -> list[str]:
        return [arrow for each in self._pressed.values() for arrow in each.active(now)]

    def _tell_effect(self) -> None:
        force = self.strength.value
        self._effect.content = '' if not self._mass else (
            '<div style="font-size: 0.85em; padding: 0 1em 0.4em">'
            f'{force:g} N for {SHOVE:g} s give {self._mass:.3g} kg '
            f'{force * SHOVE / self._mass:.2g} m/s, a tap {force * TAP / self._mass:.2g} m/s</div>')
