"""The health of what is shown: a dot with a reason in plain words, and figures in a folder."""
from __future__ import annotations

import html
import math
from typing import NamedTuple

import numpy as np
import viser

from ..model.scene import Scene
from .sources.source import SourceStatus
from .widgets.form import AMBER, GREEN, GREY, RED, colored

PERIOD = 0.5
"""s between two updates of the figures, so that they can be read; the dot changes at once."""

GRACE = 2.0
"""s without warnings after a resume, a load or another pace: what is measured over the last second
includes the time before, and a node reports it a second later."""

LATE = 0.95
"""Fraction of the requested real-time factor below which the node's diagnostics warn, too."""

MAX_ENERGY_GAIN = 1e-3
"""Energy gain that raises a warning, as a fraction of the energy of a fall and the work done."""

SLOW = ('Slower than requested: a tick takes {cost:.1f} of {due:.1f} ms. Choose accuracy draft, or '
        'a lower speed in the bar below.')
BUSY = 'Slower than requested: the machine is busy with other programs.'
GAINED = ('Inaccurate: {energy:.3g} J of energy have come from errors of the computation. Use '
          'accuracy exact, or the engine rigid.')
SILENT = 'No messages from the node.'


class Health(NamedTuple):
    """Colour of the dot, and its reason."""

    color: str
    text: str


class HealthPanel:
    """A dot with its reason, and a folder of figures, in the GUI container that is current."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self.dot = gui.add_html('')
        self._folder = gui.add_folder('Figures', expand_by_default=False, visible=False)
        with self._folder:
            self.figures = gui.add_html('')
        self._conditions: tuple = ()
        self._calm_until = self._next_update = 0.0

    def show(self, status: SourceStatus, scene: Scene, now: float) -> None:
        """Show the health at ``now`` s of a steady clock."""
        conditions = (status.paused, status.silent, status.real_time_factor, status.engine_name,
                      scene)
        if conditions != self._conditions:
            self._conditions, self._calm_until = conditions, now + GRACE
        found = health(status, scene)
        if found is not None and found.color in (AMBER, RED) and now < self._calm_until:
            found = Health(GREEN, 'Running')
        _set_content(self.dot, '' if found is None else _dot(found))
        self._folder.visible = found is not None and found.color != GREY
        if now >= self._next_update:
            self._next_update = now + PERIOD
            _set_content(self.figures, colored(figures(status, scene), GREY))


def health(status: SourceStatus, scene: Scene) -> Health | None:
    """Whether the source is silent, wrong, slow or well; None if it does not compute."""
    if status.silent:
        return Health(GREY, SILENT)
    if status.problem:
        return Health(RED, status.problem)
    if math.isnan(status.tick_cost):
        return None
    energy = max(0.0, status.measures.get('energy_excess_J', 0.0))
    if energy > MAX_ENERGY_GAIN * _reference_energy(status, scene):
        return Health(RED, GAINED.format(energy=energy))
    if not status.paused and status.measured_real_time_factor < LATE * status.real_time_factor:
        cost, due = _cost_and_due(status, scene)
        return Health(AMBER, (SLOW if cost > LATE * due else BUSY).format(cost=cost, due=due))
    return Health(GREEN, 'Paused' if status.paused else 'Running')


def figures(status: SourceStatus, scene: Scene) -> str:
    """Real-time factor, cost and energy error as text, empty if unknown."""
    if math.isnan(status.tick_cost):
        return ''
    cost, due = _cost_and_due(status, scene)
    lines = [f'tick {cost:.2f} of {due:.1f} ms',
             f'energy excess {max(0.0, status.measures.get("energy_excess_J", 0.0)):.2g} J']
    measured = status.measured_real_time_factor
    if not (status.paused or math.isnan(measured)):
        lines.insert(0, f'real-time factor {measured:.2f} of {status.real_time_factor:g}')
    return '\n'.join(lines)


def _cost_and_due(status: SourceStatus, scene: Scene) -> tuple[float, float]:
    """Wall time of computing a tick, and wall time from one tick to the next, ms."""
    return 1e3 * status.tick_cost, 1e3 * scene.step / status.real_time_factor


def _reference_energy(status: SourceStatus, scene: Scene) -> float:
    """Energy, J, of a fall of all bones by 1 m plus the absolute work of pushes and of grabs."""
    fall = sum(bone.mass for bone in scene.bones) * float(np.linalg.norm(scene.gravity))
    return fall + sum(abs(status.measures.get(f'work_of_{cause}_J', 0.0))
                      for cause in ('pushes', 'grabs'))


def _dot(found: Health) -> str:
    """HTML of the dot and its reason, which is read out when it changes."""
    return ('<div role="status" style="font-size: 0.85em; padding: 0 1em 0.4em; '
            # Two lines: what is below stays where it is.
            'min-height: 3em; overflow-wrap: anywhere">'
            f'<span aria-hidden="true" style="color: {found.color}">&#9679;</span> '
            f'{html.escape(found.text)}</div>')


def _set_content(handle: viser.GuiHtmlHandle, text: str) -> None:
    """Set the HTML of a widget if it has changed, as each assignment is sent to all pages."""
    if handle.content != text:
        handle.content = text
