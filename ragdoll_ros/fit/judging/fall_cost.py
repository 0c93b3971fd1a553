"""What the fall of dolls costs on this machine: processor time per tick, and what touches most."""
import textwrap
import time
from collections import Counter
from dataclasses import dataclass

import numpy as np

from ...model import errors
from ...model.scene import Scene

DURATION = 2.0
"""s of each fall: a person has fallen after one, and rocks for another."""

ACCURACIES = ('normal', 'draft')

BUDGET = 0.4
"""s of processor time after which a fall ends: its ticks are enough for a median."""

SLOW = 5.0
"""ms per tick above which the report says what touches most: half of what real time allows."""

NAMED_PAIRS = 3
"""The pairs of bodies that are named."""


@dataclass(frozen=True)
class FallCost:
    """Processor time of the ticks of one fall, and its contacts.

    The fall ends after DURATION or BUDGET, or when all dolls sleep.
    """

    accuracy: str
    step: float
    """s, the length of a tick."""
    ticks: np.ndarray
    """ms of each tick (t,), without the first, which loads code."""
    contacts: Counter[tuple[str, str]]
    """Contact points of each pair at the ends of all ticks: a bone, and a bone or what stands."""

    def __str__(self) -> str:
        return (f'{np.median(self.ticks):.2g} at {self.accuracy} '
                f'(95 %: {np.percentile(self.ticks, 95):.2g})')


def measure_costs(scene: Scene) -> list[FallCost]:
    """The costs of the first seconds of a scene, for each of ACCURACIES with the default engine.

    Empty if the scene cannot be simulated. Call it after a first simulation, or the compilation of
    machine code counts as a cost.
    """
    try:
        return [_measure(scene, accuracy) for accuracy in ACCURACIES]
    except errors.RagdollError:
        return []  # the drop test says why


def _measure(scene: Scene, accuracy: str) -> FallCost:
    # Imported here: fitting alone needs no engine.
    from ...physics.simulation import Simulation
    costs, pairs = [], Counter[tuple[str, str]]()
    with Simulation(scene, accuracy=accuracy) as simulation:
        names = scene.bone_names
        for _ in range(round(DURATION / scene.step)):
            begun = time.process_time()
            simulation.advance()
            costs.append(1e3 * (time.process_time() - begun))
            contacts = simulation.contacts
            for a, b, body in zip(contacts.a, contacts.b, contacts.bodies, strict=True):
                first, second = (a, b) if b < 0 else (min(a, b), max(a, b))
                pairs[names[first], scene.touched_name(second, body)] += 1
            if simulation.asleep or sum(costs) > 1e3 * BUDGET:
                break
    return FallCost(accuracy, scene.step, np.array(costs[1:] or costs), pairs)


def costs_report(costs: list[FallCost]) -> list[str]:
    """A line with the costs, and advice if the mean at the first accuracy is above SLOW."""
    if not costs:
        return []
    ticks = ' and '.join(str(len(cost.ticks)) for cost in costs)
    slow = _advice(costs[0].contacts) if costs[0].ticks.mean() > SLOW else ''
    return [f'cost here, ms per tick of {1e3 * costs[0].step:g} ms, median: '
            f'{", ".join(map(str, costs))}; {ticks} ticks',
            *textwrap.wrap(slow, 97, subsequent_indent='  ', break_long_words=False)]


def _advice(contacts: Counter[tuple[str, str]]) -> str:
    total = sum(contacts.values())
    most = ', '.join(f'{first} and {second} ({100 * count / total:.0f} %)'
                     for (first, second), count in contacts.most_common(NAMED_PAIRS))
    return ("slow: fewer bodies cost less, and so do pairs in the doll's no_collision"
            + (f'; most of its contacts are those of {most}' if most else ''))
