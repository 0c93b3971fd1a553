"""How fine an engine steps, as one number: the length of its steps."""
from __future__ import annotations

import dataclasses
import functools
import math

from ..model.errors import RagdollError
from ..physics.engine.registry import resolve_engine
from ..physics.settings import ACCURACIES, Accuracy

TICK = 0.01
"""s in which substeps are counted."""

CORE = 'rigid'
"""Name of the engine that solves impacts where they happen."""

LEAST_FLIGHT_ERROR = 1e-13
"""m or rad; below it a flight's estimate is rounding."""

PLAIN = {'sleep': False, 'energy': False, 'momentum': False, 'centred': False, 'land': False,
         'redo': math.inf, 'order': 0, 'adaptive': False}
"""Mechanisms that would hide what a step alone does."""


@functools.cache
def has_core() -> bool:
    """Whether the engine that all others are compared with is there and can be made."""
    try:
        resolve_engine(CORE)
    except (RagdollError, ImportError):
        return False
    return True


def core_step(setting: str = 'normal') -> float:
    """Longest step, s, of the core at a setting while something touches."""
    return getattr(ACCURACIES[setting], 'step', TICK / 10)


def of_step(step: float) -> Accuracy:
    """An accuracy whose steps, of whatever engine, are ``step`` s long where it can choose."""
    normal, count = ACCURACIES['normal'], max(1, round(TICK / step))
    wanted = {**PLAIN, 'step': step, 'substeps': count, 'contact': count, 'settled': count,
              'most': count, 'flight_error': LEAST_FLIGHT_ERROR}
    known = {field.name for field in dataclasses.fields(normal)}
    return dataclasses.replace(normal, **{key: value for key, value in wanted.items()
                                          if key in known})
