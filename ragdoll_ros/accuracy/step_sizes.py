"""Engines driven with a fixed step size, for convergence studies."""
from __future__ import annotations

import dataclasses
import functools

from ..model.errors import RagdollError
from ..physics.accuracy import ACCURACIES, NORMAL, Accuracy
from ..physics.engine.registry import resolve_engine

TICK = 0.01
"""s: substeps are counted per tick of this length."""

RIGID = 'rigid'
"""Name of this package's own engine, which solves impacts at their time of impact."""

MIN_FLIGHT_ERROR = 1e-13
"""m or rad: smaller error estimates in flight are rounding."""


@functools.cache
def has_rigid_engine() -> bool:
    """Whether the rigid engine can be created here."""
    try:
        resolve_engine(RIGID)
    except (RagdollError, ImportError):
        return False
    return True


def contact_step(setting: str = 'normal') -> float:
    """Largest step, s, of the rigid engine at a setting while in contact."""
    return ACCURACIES[setting].step


def fixed_steps(step: float) -> Accuracy:
    """Accuracy with steps of ``step`` s, without energy correction and sleep, which hide errors."""
    return dataclasses.replace(NORMAL, step=step, substeps=TICK / step, energy=False, sleep=False,
                               flight_error=MIN_FLIGHT_ERROR)
