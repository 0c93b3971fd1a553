"""Faults that are put into an engine's own memory."""
from __future__ import annotations

import numpy as np

from ragdoll_ros.model.coordinates import GeneralizedState

POISONS = {'a NaN': ('q', 0, lambda value: np.nan, 'not finite'),
           'a NaN among the angles': ('q', -1, lambda value: np.nan, 'not finite'),
           'a NaN of speed': ('v', -1, lambda value: np.nan, 'not finite'),
           'infinity': ('v', 0, lambda value: np.inf, 'finite'),
           '1e12 m': ('q', 0, lambda value: 1e12, 'farther than'),
           '-1e12 m': ('q', 2, lambda value: -1e12, 'farther than'),
           'energy': ('v', slice(0, 3), lambda value: 3 * value + 3.0, 'energy rose')}
"""Which of a doll's numbers, what they become, and what is said of it."""


def poison(simulation, kind, dolls=slice(0, 1)):
    """Write into the engine's memory, as a fault of its own would."""
    engine = simulation._engine
    array, place, spoilt, reason = POISONS[kind]
    if simulation.engine_name == 'rigid':
        owns = {'q': engine.layout.doll_q, 'v': engine.layout.doll_v}[array][dolls]
        for own in owns:
            numbers = getattr(engine._clusters, array)[own]
            numbers[place] = spoilt(numbers[place])
        engine._clusters.gather_state()
        engine._clusters.invalidate()  # a step of flight that is under way would write over it
    else:
        here = {'q': engine.coordinates.q.copy(), 'v': engine.coordinates.v.copy()}
        here[array][place] = spoilt(here[array][place])
        engine._set_state(GeneralizedState(**here))
    return reason
