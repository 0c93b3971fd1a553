"""Settings of the current scene: accuracy, gravity, ground, friction; health above them."""
from __future__ import annotations

import asyncio
import dataclasses
import math
from collections.abc import Callable

import numpy as np
import viser

from ..model import errors
from ..model.scene import Ground, Scene
from ..physics.accuracy import ACCURACIES
from .health import HealthPanel
from .sources.source import Source, SourceStatus
from .widgets import parsing
from .widgets.error_text import error_text
from .widgets.form import GREY, RED, Field, Form, colored

ERRORS_MM = {'rigid': {'draft': 0.46, 'normal': 0.27, 'exact': 0.03},
             'bullet': {'draft': 7, 'normal': 5, 'exact': 4},
             'mujoco': {'draft': 16, 'normal': 10, 'exact': 6}}
"""Position error of the default doll's bones after 0.1 s of contacts, median of 240 segments, for
each engine: docs/accuracy.md, 'pieces'. `exact` of PyBullet and MuJoCo is that of 32 substeps."""

FIELDS = (
    Field('gravity', 'Gravity, m/s²', 'vector', 'Along x, y, z; z is up'),
    Field('friction', 'Friction', 'text', 'Of bones without their own; inf: no slip'),
    Field('restitution', 'Restitution', 'number', '0: no bounce, 1: full bounce'),
    Field('slope', 'Slope, °', 'number', 'Of the ground, which falls towards +x, the front of '
          'the home view; 0: level'))

MAX_SLOPE = 80.0
"""Degrees: more is no ground to lie on."""


class SettingsPanel:
    """A folder of the panel, and the health above it."""

    def __init__(self, server: viser.ViserServer, source: Source) -> None:
        self.source = source
        self._scene: Scene | None = None
        self._shown_accuracy = ''
        gui = server.gui
        self.health = HealthPanel(gui)
        with gui.add_folder('Settings', expand_by_default=False, visible=source.recording is None):
            self.accuracy = gui.add_dropdown('Accuracy', tuple(ACCURACIES), visible=False,
                                             hint='Step size; the simulation continues')
            self.cost = gui.add_html('')
            self.form = Form(gui, FIELDS, lambda key, kind: None)
            self.ground = gui.add_checkbox('Ground', True)
            self.apply = gui.add_button('Apply and restart', icon='check', color='green',
                                        hint='Restart the scene with these settings')
            self.message = gui.add_html('')
        self.accuracy.on_update(self._on_accuracy)
        self.apply.on_click(lambda _: self._apply())

    def show(self, status: SourceStatus, scene: Scene, now: float) -> None:
        """Show the health at ``now`` s of a steady clock, and the settings of a new scene."""
        if scene is not self._scene:
            self._scene = scene
            self.form.fill({'gravity': scene.gravity, 'restitution': scene.material.restitution,
                            'friction': parsing.format_number(scene.material.friction),
                            'slope': slope_of(scene.ground or Ground())})
            self.ground.value = scene.ground is not None
        self.health.show(status, scene, now)
        cost = colored(self._cost(status), GREY)
        if self.cost.content != cost:
            self.cost.content = cost
        self.accuracy.visible = status.accuracy in ACCURACIES
        if status.accuracy != self._shown_accuracy and status.accuracy in ACCURACIES:
            self._shown_accuracy = self.accuracy.value = status.accuracy

    @staticmethod
    def _cost(status: SourceStatus) -> str:
        """Text on the cost and the position error of the accuracy."""
        error = ERRORS_MM.get(status.engine_name, {}).get(status.accuracy)
        if error is None or math.isnan(status.tick_cost):
            return ''
        return (f'A tick takes {parsing.two_digits(1e3 * status.tick_cost)} ms. Typical error: '
                f'{error:g} mm after 0.1 s of contacts.')

    async def _on_accuracy(self, event: viser.GuiEvent) -> None:
        """Set the chosen accuracy in another thread, as it may wait for a node's response."""
        if event.client is not None:
            asyncio.get_running_loop().run_in_executor(
                None, self._try, lambda name=event.target.value: self.source.set_accuracy(name))

    def enter(self, field: str) -> None:
        """Apply the settings if Enter was pressed in one of their fields; in viser's thread."""
        if self.form.has(field):
            asyncio.get_running_loop().run_in_executor(None, self._apply)

    def _apply(self) -> None:
        """Restart with the fields' changed values, or show errors below them."""
        values, found = self.form.values()
        scene = self._scene
        if scene is None:
            return
        try:
            if 'friction' in values:
                values['friction'] = parsing.parse_number(values['friction'], infinite=True)
        except errors.ModelError as error:
            del values['friction']
            found.append(error.at('friction'))
        material = scene.material
        for key in values.keys() & {'friction', 'restitution'}:
            try:
                material = dataclasses.replace(material, **{key: values[key]})
            except errors.ModelError as error:
                found.append(type(error)(key, error.value, error.expected))
        ground = (scene.ground or Ground()) if self.ground.value else None
        try:
            if ground is not None and 'slope' in values:
                ground = sloping(ground, scene, values['slope'])
        except errors.ModelError as error:
            found.append(error)
        try:
            scene = dataclasses.replace(scene, gravity=values.get('gravity', scene.gravity),
                                        material=material, ground=ground)
        except errors.ModelError as error:
            found.append(error)
        self.form.show_errors(found)
        if not found:
            self._try(lambda: self.source.set_scene(scene))

    def _try(self, change: Callable[[], None]) -> None:
        """Make a change, or show why it is refused."""
        try:
            change()
            self.message.content = ''
        except errors.RagdollError as error:
            text = error_text(error) if isinstance(error, errors.ModelError) else str(error)
            self.message.content = colored(text, RED)
            self._shown_accuracy = ''


def slope_of(ground: Ground) -> float:
    """Angle between the ground and the horizontal, degrees."""
    x, y, z = ground.normal
    return round(math.degrees(math.atan2(math.hypot(x, y), z)), 6)


def sloping(ground: Ground, scene: Scene, slope: float) -> Ground:
    """Tilt the ground to a slope, degrees, about its point below the middle of all dolls.

    It descends in the same direction as before, or towards +x if it was level. Raises OutOfRange.
    """
    errors.check_range('slope', slope, 0.0, MAX_SLOPE)
    if slope == slope_of(ground):
        return ground
    x, y, z = ground.normal
    heading = math.atan2(y, x) if math.hypot(x, y) > 1e-9 else 0.0
    middle = np.mean([placement.position for placement in scene.dolls], axis=0)
    middle[2] = (ground.offset - x * middle[0] - y * middle[1]) / z if z > 1e-9 else 0.0
    angle = math.radians(slope)
    normal = np.array((math.sin(angle) * math.cos(heading), math.sin(angle) * math.sin(heading),
                       math.cos(angle)))
    return dataclasses.replace(ground, normal=tuple(normal.tolist()), offset=float(normal @ middle))
