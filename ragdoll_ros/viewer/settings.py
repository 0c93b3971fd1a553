"""Settings of the scene at hand: accuracy with its price, gravity, ground, friction; its health."""
from __future__ import annotations

import asyncio
import dataclasses
import math
from collections.abc import Callable

import viser

from ..model import errors
from ..model.scene import Ground, Scene
from ..physics.accuracy import ACCURACIES
from .editor.sheet import Field
from .health import health
from .sources.source import Report, Source
from .widgets import number_parsing
from .widgets.error_text import in_words
from .widgets.form import GREEN, RED, Form, colored

AMBER = '#e67700'

PERIOD = 0.5
"""s for which figures stand, to be read; a warning comes and goes at once."""

ERRORS_MM = {'rigid': {'draft': 0.37, 'normal': 0.2, 'exact': 0.02},
             'bullet': {'draft': 14, 'normal': 13, 'exact': 15},
             'mujoco': {'draft': 18, 'normal': 18, 'exact': 16}}
"""By how much bones of the default doll are off after 0.1 s of contacts, median of 60 pieces, for
each engine: docs/accuracy.md, 'pieces'. The finest of PyBullet and MuJoCo there has 32 substeps."""

FIELDS = (
    Field('gravity', 'gravity, m/s²', 'vector', 'along x, y, z; z is up'),
    Field('friction', 'scene friction', 'text', 'of what has none of its own; inf: no slip'),
    Field('restitution', 'bounce', 'number', 'restitution: 0 none, 1 all of it'))


class Settings:
    """A folder of the panel, and a line above it that tells how the simulation does."""

    def __init__(self, server: viser.ViserServer, source: Source) -> None:
        self.source = source
        self._loop = server.get_event_loop()
        self._scene: Scene | None = None
        self._shown = ''
        self._next = 0.0
        self._warns = False
        gui = server.gui
        self.health = gui.add_html('')
        with gui.add_folder('Settings', expand_by_default=False,
                            visible=source.recording is None):
            self.accuracy = gui.add_dropdown('Accuracy', tuple(ACCURACIES), visible=False,
                                             hint='how finely it steps; goes on from where it is')
            self.price = gui.add_html('')
            self.form = Form(gui, FIELDS, lambda key, kind: None)
            self.ground = gui.add_checkbox('Ground', True)
            self.use = gui.add_button('Start with these', icon='check', color='green',
                                      hint='start the scene anew with these')
            self.said = gui.add_html('')
        self.accuracy.on_update(self._choose)
        self.use.on_click(lambda _: self._use())

    def show(self, report: Report, scene: Scene, now: float) -> None:
        """Show how the source does at ``now`` s of a steady clock, and the settings of its scene
        if that is another one.
        """
        if scene is not self._scene:
            self._scene = scene
            self.form.fill({'gravity': scene.gravity, 'restitution': scene.material.restitution,
                            'friction': number_parsing.shown(scene.material.friction)})
            self.ground.value = scene.ground is not None
        line, warns = health(report, scene)
        if now >= self._next or warns != self._warns:
            self._next, self._warns = now + PERIOD, warns
            _write(self.health, colored(line, AMBER if warns else GREEN))
            _write(self.price, colored(self._price(report), GREEN))
        self.accuracy.visible = report.accuracy in ACCURACIES
        if report.accuracy != self._shown and report.accuracy in ACCURACIES:
            self._shown = self.accuracy.value = report.accuracy

    @staticmethod
    def _price(report: Report) -> str:
        """What the accuracy costs here, and how far bones are off with it."""
        off = ERRORS_MM.get(report.engine_name, {}).get(report.accuracy)
        if off is None or math.isnan(report.tick_cost):
            return ''
        return (f'{1e3 * report.tick_cost:.2f} ms a tick here; by the report the default doll is '
                f'{off:g} mm off after 0.1 s of contacts (median)')

    async def _choose(self, event: viser.GuiEvent) -> None:
        """Take the chosen accuracy; it may wait for a node's answer."""
        if event.client is not None:
            asyncio.get_running_loop().run_in_executor(
                None, self._ask, lambda name=event.target.value: self.source.take_accuracy(name))

    def _use(self) -> None:
        """Start anew with what stands in the fields; what is wrong is said beside it."""
        sheet, found = self.form.values()
        scene = self._scene
        if scene is None:
            return
        try:
            sheet['friction'] = number_parsing.number(sheet['friction'], infinite=True)
        except errors.ModelError as error:
            del sheet['friction']
            found.append(error.at('friction'))
        material = scene.material
        for key in sheet.keys() & {'friction', 'restitution'}:
            try:
                material = dataclasses.replace(material, **{key: sheet[key]})
            except errors.ModelError as error:
                found.append(type(error)(key, error.value, error.expected))
        self.form.tell(found)
        if found:
            return
        ground = (scene.ground or Ground()) if self.ground.value else None
        self._ask(lambda: self.source.use(dataclasses.replace(
            scene, gravity=sheet['gravity'], material=material, ground=ground)))

    def _ask(self, change: Callable[[], None]) -> None:
        """Ask for a change; say why where it is refused."""
        try:
            change()
            self.said.content = ''
        except errors.ModelError as error:
            self.said.content = colored(in_words(error), RED)
            self._shown = ''
        except errors.RagdollError as error:
            self.said.content = colored(str(error), RED)
            self._shown = ''


def _write(place: viser.GuiHtmlHandle, text: str) -> None:
    """Write it there if it is not there yet: each writing is sent to all pages."""
    if place.content != text:
        place.content = text
