"""What a tick of a shipped scene costs on this machine, before the scene is loaded.

costs.json has the cost of the busiest second of each scene, written by docs/gallery.py, and that of
a short reference run in the same units. The same reference run here gives the ratio of the
machines.
"""
from __future__ import annotations

import json
import os
import time
from pathlib import Path

from ...files.scene import load_scene
from ...physics.simulation import Simulation
from ..widgets.parsing import two_digits

FOLDER = Path(__file__).parent

REFERENCE_SCENE, REFERENCE_TICKS = 'drop', 100
"""The run of reference: 1 s, a fall and its contacts."""

COSTS: dict[str, list[float]] = json.loads((FOLDER / 'costs.json').read_text('utf-8'))
"""Of each scene: ms of one processor's time for a tick, and how many processors can share it."""


def reference_cost() -> float:
    """Processor time of a tick of the reference run, ms; takes about 0.1 s."""
    with Simulation(load_scene(REFERENCE_SCENE), engine='rigid') as simulation:
        simulation.advance()
        begin = time.thread_time()
        for _ in range(REFERENCE_TICKS):
            simulation.advance()
        return (time.thread_time() - begin) / REFERENCE_TICKS * 1e3


def estimated_cost(name: str, reference: float) -> float:
    """Wall time of a tick of a scene in its busiest second, ms; ``reference``: as measured here."""
    cost, threads = COSTS[name]
    processors = min(len(os.sched_getaffinity(0)), threads)
    return cost * reference / COSTS['reference'][0] / processors


def cost_text(cost: float, step: float, pace: float) -> tuple[str, bool]:
    """A cost, ms, in words, and whether ticks of ``step`` s are too slow for a ``pace``."""
    factor = 1e3 * step / cost
    ticks = f'a tick of {1e3 * step:g} ms takes {two_digits(cost)} ms'
    if factor >= pace:
        rate = 'Real time here' if pace == 1 else f'Its pace, {pace:g} of real time, here'
        return f'{rate}: {ticks}', False
    return f'At most {factor:.2g} of real time here: {ticks}', True
