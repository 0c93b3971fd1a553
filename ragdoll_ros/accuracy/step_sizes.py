"""How fine an engine steps, as one number: the length of its steps."""
from __future__ import annotations

import dataclasses
import functools

from ..model.errors import RagdollError
from ..physics.accuracy import ACCURACIES, NORMAL, Accuracy
from ..physics.engine.registry import resolve_engine

TICK = 0.01
"""s in which substeps are counted."""

RIGID = 'rigid'
"""Name of the engine that solves impacts where they happen."""

LEAST_FLIGHT_ERROR = 1e-13
"""m or rad; below it a flight's estimate is rounding."""


@functools.cache
def has_rigid_engine() -> bool:
    """Whether the engine that all others are compared with is there and can be made."""
    try:
        resolve_engine(RIGID)
    except (RagdollError, ImportError):
        return False
    return True


def contact_step(setting: str = 'normal') -> float:
    """Longest step, s, of the core at a setting while something touches."""
    return ACCURACIES[setting].step


def fixed_steps(step: float) -> Accuracy:
    """An accuracy of steps of ``step`` s, of whatever engine, without what would hide their errors:
    no account of energy, no sleep.
    """
    return dataclasses.replace(NORMAL, step=step, substeps=TICK / step, energy=False, sleep=False,
                               flight_error=LEAST_FLIGHT_ERROR)
