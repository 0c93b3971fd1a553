"""Settings of the current scene: accuracy, gravity, ground, friction; and the health line."""
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
from .sources.source import Source, SourceStatus
from .widgets import number_parsing
from .widgets.error_text import error_text
from .widgets.fields import Field
from .widgets.form import GREEN, RED, Form, colored

AMBER = '#e67700'

PERIOD = 0.5
"""s between two updates of the figures, so that they can be read; warnings change at once."""

ERRORS_MM = {'rigid': {'draft': 0.37, 'normal': 0.2, 'exact': 0.02},
             'bullet': {'draft': 14, 'normal': 13, 'exact': 15},
             'mujoco': {'draft': 18, 'normal': 18, 'exact': 16}}
"""Position error of the default doll's bones after 0.1 s of contacts, median of 60 pieces, for
each engine: docs/accuracy.md, 'pieces'. The finest of PyBullet and MuJoCo there has 32 substeps."""

FIELDS = (
    Field('gravity', 'gravity, m/s²', 'vector', 'along x, y, z; z is up'),
    Field('friction', 'scene friction', 'text', 'of bones without their own; inf: no slip'),
    Field('restitution', 'restitution', 'number', '0: no bounce, 1: full bounce'))

LATE = 0.95
"""Fraction of the requested real-time factor below which the node's diagnostics warn, too."""

MAX_ENERGY_GAIN = 1e-3
"""Energy gain that raises a warning, as a fraction of the energy of a fall and the work done."""

SLOW = ('a tick takes {cost:.1f} ms and one is due every {due:.1f} ms: use accuracy draft, or a '
        'lower real-time factor')
BUSY = 'ticks are late though one takes {cost:.1f} of {due:.1f} ms: the machine is busy'
GAINED = '{energy:.3g} J of energy error: use accuracy exact, or the engine rigid'


class SettingsPanel:
    """A folder of the panel, and the health line above it."""

    def __init__(self, server: viser.ViserServer, source: Source) -> None:
        self.source = source
        self._scene: Scene | None = None
        self._shown_accuracy = ''
        self._next_update = 0.0
        self._warns = False
        gui = server.gui
        self.health = gui.add_html('')
        with gui.add_folder('Settings', expand_by_default=False,
                            visible=source.recording is None):
            self.accuracy = gui.add_dropdown('Accuracy', tuple(ACCURACIES), visible=False,
                                             hint='step size; the simulation continues')
            self.cost = gui.add_html('')
            self.form = Form(gui, FIELDS, lambda key, kind: None)
            self.ground = gui.add_checkbox('Ground', True)
            self.apply = gui.add_button('Apply and restart', icon='check', color='green',
                                        hint='restart the scene with these settings')
            self.message = gui.add_html('')
        self.accuracy.on_update(self._on_accuracy)
        self.apply.on_click(lambda _: self._apply())

    def show(self, status: SourceStatus, scene: Scene, now: float) -> None:
        """Show the health at ``now`` s of a steady clock, and the settings of a new scene."""
        if scene is not self._scene:
            self._scene = scene
            self.form.fill({'gravity': scene.gravity, 'restitution': scene.material.restitution,
                            'friction': number_parsing.format_number(scene.material.friction)})
            self.ground.value = scene.ground is not None
        line, warns = health_line(status, scene)
        if now >= self._next_update or warns != self._warns:
            self._next_update, self._warns = now + PERIOD, warns
            _set_content(self.health, colored(line, AMBER if warns else GREEN))
            _set_content(self.cost, colored(self._cost(status), GREEN))
        self.accuracy.visible = status.accuracy in ACCURACIES
        if status.accuracy != self._shown_accuracy and status.accuracy in ACCURACIES:
            self._shown_accuracy = self.accuracy.value = status.accuracy

    @staticmethod
    def _cost(status: SourceStatus) -> str:
        """Text on the cost and the position error of the accuracy."""
        error = ERRORS_MM.get(status.engine_name, {}).get(status.accuracy)
        if error is None or math.isnan(status.tick_cost):
            return ''
        return (f'{1e3 * status.tick_cost:.2f} ms per tick; position error of the default doll in '
                f'the accuracy report: {error:g} mm after 0.1 s of contacts (median)')

    async def _on_accuracy(self, event: viser.GuiEvent) -> None:
        """Set the chosen accuracy in another thread, as it may wait for a node's response."""
        if event.client is not None:
            asyncio.get_running_loop().run_in_executor(
                None, self._try, lambda name=event.target.value: self.source.set_accuracy(name))

    def _apply(self) -> None:
        """Restart with the values of the fields, or show errors below them."""
        values, found = self.form.values()
        scene = self._scene
        if scene is None:
            return
        try:
            values['friction'] = number_parsing.parse_number(values['friction'], infinite=True)
        except errors.ModelError as error:
            del values['friction']
            found.append(error.at('friction'))
        material = scene.material
        for key in values.keys() & {'friction', 'restitution'}:
            try:
                material = dataclasses.replace(material, **{key: values[key]})
            except errors.ModelError as error:
                found.append(type(error)(key, error.value, error.expected))
        self.form.show_errors(found)
        if found:
            return
        ground = (scene.ground or Ground()) if self.ground.value else None
        self._try(lambda: self.source.set_scene(dataclasses.replace(
            scene, gravity=values['gravity'], material=material, ground=ground)))

    def _try(self, change: Callable[[], None]) -> None:
        """Make a change, or show why it is refused."""
        try:
            change()
            self.message.content = ''
        except errors.RagdollError as error:
            text = error_text(error) if isinstance(error, errors.ModelError) else str(error)
            self.message.content = colored(text, RED)
            self._shown_accuracy = ''


def health_line(status: SourceStatus, scene: Scene) -> tuple[str, bool]:
    """Rate, cost and energy error as text, empty if unknown, and whether it is a warning."""
    if math.isnan(status.tick_cost):
        return '', False
    energy = max(0.0, status.measures.get('energy_excess_J', 0.0))
    cost, due = 1e3 * status.tick_cost, 1e3 * scene.step / status.real_time_factor
    line = f'tick {cost:.2f} of {due:.1f} ms'
    measured, requested = status.measured_real_time_factor, status.real_time_factor
    if not (status.paused or math.isnan(measured)):
        line = f'real-time factor {measured:.2f} of {requested:g} · {line}'
    line += f' · energy error {energy:.2g} J'
    if not status.paused and measured < LATE * requested:
        reason = SLOW if cost > LATE * due else BUSY
        return f'{line}\n{reason.format(cost=cost, due=due)}', True
    if energy > MAX_ENERGY_GAIN * _reference_energy(status, scene):
        return f'{line}\n{GAINED.format(energy=energy)}', True
    return line, False


def _reference_energy(status: SourceStatus, scene: Scene) -> float:
    """Energy, J, of a fall of all bones by 1 m, and the work of pushes and grabs."""
    fall = sum(bone.mass for bone in scene.bones) * float(np.linalg.norm(scene.gravity))
    return fall + sum(abs(status.measures.get(f'work_of_{cause}_J', 0.0))
                      for cause in ('pushes', 'grabs'))


def _set_content(html: viser.GuiHtmlHandle, text: str) -> None:
    """Set it only if it has changed, as each assignment is sent to all pages."""
    if html.content != text:
        html.content = text
