"""Pushes by arrow keys and buttons, relative to the camera of the page that they come from."""
from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterable

import numpy as np
import viser

from ...model.scene import Scene
from ...realtime.arrow_keys import ARTICLE, DIRECTIONS, FORCE, TAP, PressedKeys
from ...realtime.speed_limit import RESPONSE_TIME, TOP_SPEED, TOP_SPEEDS, SpeedLimit
from ..browser.scripts import add_listener
from ..sources.source import Frame, Source
from ..user_actions import UserActions
from .directions import seen_from
from .motion import Motion

ARROWS = {'←': 'left', '↑': 'up', '↓': 'down', '→': 'right'}
"""By the labels of their buttons, short enough for one row."""

STRENGTHS = (100.0, 5000.0)
"""N: smallest and largest of the slider."""

STEP = 50.0
"""N: of the slider."""

REPEAT_PERIOD = 0.04
"""s between two pushes of a held key, well below the node's push_timeout, and their duration."""


class PushKeys:
    """Buttons, keys and sliders in the current GUI container; hidden for a recording."""

    def __init__(self, server: viser.ViserServer, source: Source, actions: UserActions) -> None:
        self.motion = Motion()
        self.may_push: Callable[[], bool] = lambda: True
        self.refuse: Callable[[viser.ClientHandle | None], None] = lambda _: None
        """Called with a page that pushes while it may not."""
        self._server, self._source = server, source
        self._lock = threading.Lock()
        self._pressed: dict[int, PressedKeys] = {}
        self._scene: Scene | None = None
        self._limit = SpeedLimit()
        self._next_repeat = 0.0
        self._is_pushing = False
        gui, can_push = server.gui, source.recording is None
        self.key_events = add_listener(gui, 'keys', 'arrow_keys.js', lambda page, down: actions.run(
            self.take, page, down.split(), time.monotonic()))
        buttons = gui.add_button_group(
            'Push', tuple(ARROWS), visible=can_push, hint='As seen in the picture: left, away from '
            'you, towards you, right; arrow keys do the same, and go on while held')
        self.strength = gui.add_slider('Strength, N', *STRENGTHS, step=STEP, initial_value=FORCE,
                                       visible=can_push, hint='Of a push, and the most of a '
                                       'held key')
        self.top_speed = gui.add_slider('Top speed, m/s', *TOP_SPEEDS, step=0.5,
                                        initial_value=TOP_SPEED, visible=can_push,
                                        hint='That a held key brings the doll to')
        self._effect = gui.add_html('', visible=can_push)
        self._shown_effect: tuple = ()
        """What the text of `_effect` depends on."""
        self.strength.on_update(lambda _: self._show_effect())
        for arrow in ARROWS.values() if can_push else ():
            command = gui.add_command(f'Push {arrow}')
            command.on_trigger(actions.callback(
                lambda event, arrow=arrow: self.tap(event.client, arrow)))

        @buttons.on_click
        async def _(event: viser.GuiEvent) -> None:
            # The arrow is read before another click changes it.
            actions.run(self.tap, event.client, ARROWS[event.target.value])

        @server.on_client_disconnect
        def _(client: viser.ClientHandle) -> None:
            with self._lock:
                self._pressed.pop(client.client_id, None)

    @property
    def bone(self) -> int:
        """Index of the pushed bone in the shown scene; 0 before that is known."""
        names = () if self._scene is None else self._scene.bone_names
        return names.index(self._source.pushed_bone) if self._source.pushed_bone in names else 0

    def add(self, frame: Frame) -> None:
        """Take note of a new frame, from which speeds are known."""
        with self._lock:
            last = self.motion.frame
            if last is not None and frame.time < last.time:
                self._limit.clear()
            self.motion.add(frame)

    def choose(self, bone: str) -> None:
        """Push this bone from now on."""
        self._source.push_bone(bone)

    def tap(self, client: viser.ClientHandle | None, arrow: str) -> None:
        """Push for the duration of a tap."""
        with self._lock:
            self._tap(client, [arrow])

    def take(self, page: int, down: list[str], now: float) -> None:
        """Set which arrow keys are down on a page; a new one pushes for at least a tap."""
        with self._lock:
            pressed = self._pressed.setdefault(page, PressedKeys())
            if pressed.report(down, now):
                self._tap(self._server.get_clients().get(page), pressed.active(now))

    def update(self, now: float) -> None:
        """Repeat the pushes of held keys, and end them on release; call repeatedly."""
        with self._lock:
            clients = self._server.get_clients()
            held = {page: arrows for page, pressed in self._pressed.items()
                    if (arrows := pressed.held(now)) and page in clients and self.may_push()}
            if held and now >= self._next_repeat:
                self._next_repeat = now + REPEAT_PERIOD
                self._push_along(sum(self._direction(clients[page], arrows)
                                     for page, arrows in held.items()), RESPONSE_TIME,
                                 REPEAT_PERIOD * self._source.status.real_time_factor)
            elif self._is_pushing and not held:
                self._source.push((0.0, 0.0, 0.0), TAP)
            self._is_pushing = bool(held)
        self._show_effect()

    def show_scene(self, scene: Scene) -> None:
        """Take note of the scene that is shown."""
        self._scene = scene
        self._show_effect()

    def _direction(self, client: viser.ClientHandle | None, arrows: Iterable[str]) -> np.ndarray:
        """Sum (3,) of the directions of arrows on a page, world frame."""
        directions = DIRECTIONS
        if client is not None and self._scene is not None and self._scene.name != ARTICLE:
            camera = client.camera
            directions = seen_from(camera.position, camera.look_at, camera.up_direction)
        return np.sum([directions[arrow] for arrow in arrows], axis=0)

    def _tap(self, client: viser.ClientHandle | None, arrows: Iterable[str]) -> None:
        if not self.may_push():
            self.refuse(client)
            return
        self._push_along(self._direction(client, arrows), TAP, TAP)

    def _push_along(self, direction: np.ndarray, response: float, duration: float) -> None:
        """Push along ``direction`` (3,), the sum of the keys' unit vectors, for ``duration`` s
        simulated.

        The force is `strength` times the length of ``direction``, but at most the force that gives
        the top speed in ``response`` s.
        """
        length, frame = float(np.linalg.norm(direction)), self.motion.frame
        if frame is None or length < 1e-9:  # opposite keys
            return
        unit, status = direction / length, self._source.status
        speed = max(self.motion.doll_velocity(self.bone) @ unit,
                    self.motion.velocities()[self.bone] @ unit)
        left = self._limit.impulse(unit, self.top_speed.value - speed, self._mass(), frame.time)
        force = min(self.strength.value * length, left / response) * unit
        self._source.push(tuple(force.tolist()), duration)
        if not status.paused:  # else it waits, and nothing becomes faster
            self._limit.sent(force, frame.time, status.real_time_factor)

    def _mass(self) -> float:
        """Mass of the pushed doll, kg."""
        part = self._scene.bone_slices[self._scene.doll_of_bone[self.bone]]
        return sum(bone.mass for bone in self._scene.bones[part])

    def _show_effect(self) -> None:
        """State the pushed bone and what a tap does."""
        shown = self._scene, self.bone, self.strength.value
        if self._scene is None or shown == self._shown_effect:
            return
        self._shown_effect = shown
        text = f'Pushes {self._scene.bone_names[self.bone]}. A click chooses another bone.<br>'
        if not self._scene.yielding_bones[self.bone]:
            text += 'Nothing moves this one: it is fixed, or moves as it is told.'
        elif self._scene.dolls[self._scene.doll_of_bone[self.bone]].fixed_root:
            text += 'It hangs on a root that is fixed.'
        else:
            text += (f'A tap gives {self._mass():.3g} kg '
                     f'{self.strength.value * TAP / self._mass():.2g} m/s in the air.')
        if self._scene.ground is not None and math.isinf(self._scene.material.friction):
            text += ' Friction is unlimited: what lies on the ground does not slide.'
        self._effect.content = (
            f'<div style="font-size: 0.85em; padding: 0 1em 0.4em">{text}</div>')
