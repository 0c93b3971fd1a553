"""Whether the simulation does well: a line for the page, amber with a reason where it does not."""
from __future__ import annotations

import math

import numpy as np

from ..model.scene import Scene
from .sources.source import Report

LATE = 0.95
"""Share of the wanted pace below which the node's diagnostics warn as well."""

EXCESS = 1e-3
"""Energy from nothing, as a share of what falls and what was put in, that is worth a word."""

SLOW = 'a tick takes {cost:.1f} ms and one is due every {due:.1f}: take draft, or a slower pace'
BUSY = 'ticks come late though one takes {cost:.1f} ms of {due:.1f}: the machine is busy elsewhere'
GAINED = '{energy:.3g} J have come from nothing: take exact, or the engine rigid'


def health(report: Report, scene: Scene) -> tuple[str, bool]:
    """The line, empty where nothing is known, and whether it warns."""
    if math.isnan(report.tick_cost):
        return '', False
    energy = max(0.0, report.measures.get('energy_excess_J', 0.0))
    cost, due = 1e3 * report.tick_cost, 1e3 * scene.step / report.pace
    line = f'tick {cost:.2f} of {due:.1f} ms'
    if not (report.paused or math.isnan(report.reached)):
        line = f'pace {report.reached:.2f} of {report.pace:g} · {line}'
    line += f' · energy from nothing {energy:.2g} J'
    if not report.paused and report.reached < LATE * report.pace:
        reason = SLOW if cost > LATE * due else BUSY
        return f'{line}\n{reason.format(cost=cost, due=due)}', True
    if energy > EXCESS * _at_hand(report, scene):
        return f'{line}\n{GAINED.format(energy=energy)}', True
    return line, False


def _at_hand(report: Report, scene: Scene) -> float:
    """Energy, J: of a fall of all by a metre, and the work that was put in."""
    fall = sum(bone.mass for bone in scene.bones) * float(np.linalg.norm(scene.gravity))
    return fall + sum(abs(report.measures.get(f'work_of_{who}_J', 0.0))
                      for who in ('pushes', 'grabs'))
