"""Peaks of the acceleration that a worn sensor reads in a fall."""
from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from ..physics.sensors.head_injury import STANDARD_GRAVITY

EARLY = 6.0
"""g: before the impact, people's falls stay below it."""


def _empty() -> np.ndarray:
    return np.zeros(0)


@dataclass(frozen=True)
class Peaks:
    """Of a sensor in f falls; NaN where a fall has no sample."""

    sensor: str = ''
    bone: str = ''
    largest: np.ndarray = field(default_factory=_empty)
    """(f,) g: largest magnitude of the specific force."""
    widths: np.ndarray = field(default_factory=_empty)
    """(f,) s: full width of that peak at half its height, in whole samples."""
    before_impact: np.ndarray = field(default_factory=_empty)
    """(f,) g: the largest before the frame of the first contact; NaN without one."""

    @classmethod
    def of(cls, sensor: dict, falls: Iterable[np.ndarray], impacts: np.ndarray,
           interval: float) -> Peaks:
        """Of samples (s, 3) m/s^2 of each fall, ``interval`` s apart, the first at the start;
        ``impacts`` (f,) s from the start, NaN without one.
        """
        found = np.array([
            _peak(np.linalg.norm(samples, axis=1) / STANDARD_GRAVITY, impact / interval)
            for samples, impact in zip(falls, impacts, strict=True)]).reshape(-1, 3)
        return cls(sensor['name'], sensor['bone'], found[:, 0], found[:, 1] * interval, found[:, 2])

    @property
    def share_early(self) -> float:
        """Share of the falls with an impact that pass EARLY before it."""
        known = self.before_impact[np.isfinite(self.before_impact)]
        return float((known > EARLY).mean()) if len(known) else 0.0


def _peak(force: np.ndarray, impact: float) -> tuple[float, float, float]:
    """Largest value, its full width at half maximum in samples, and the largest before sample
    ``impact``.
    """
    force = force[np.isfinite(force)]
    if not len(force):
        return np.nan, np.nan, np.nan
    top = int(force.argmax())
    low = np.flatnonzero(force < force[top] / 2)
    before, after = low[low < top], low[low > top]
    width = (after[0] if len(after) else len(force)) - (before[-1] + 1 if len(before) else 0)
    early = force[:int(impact)] if np.isfinite(impact) else force[:0]
    return force[top], width, early.max() if len(early) else np.nan
