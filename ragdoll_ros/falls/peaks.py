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
    """Peaks of the specific force of a sensor in f falls; NaN where a fall has no sample."""

    sensor: str = ''
    bone: str = ''
    largest: np.ndarray = field(default_factory=_empty)
    """(f,) g: largest magnitude of the specific force."""
    widths: np.ndarray = field(default_factory=_empty)
    """(f,) s: full width of that peak at half its height, in whole samples."""
    before_impact: np.ndarray = field(default_factory=_empty)
    """(f,) g: the largest before the frame of the first contact; NaN without one."""
    before_pelvis: np.ndarray = field(default_factory=_empty)
    """(f,) g: the largest before the pelvis touches the ground; NaN if it never does."""

    @classmethod
    def of(cls, sensor: dict, falls: Iterable[np.ndarray], impacts: np.ndarray, pelvis: np.ndarray,
           interval: float) -> Peaks:
        """Find the peaks in samples (s, 3) m/s^2 of each fall, ``interval`` s apart, the first at
        the start. ``impacts`` and ``pelvis`` (f,) are the times, s from the start, of the first
        contact and of the first contact of the pelvis; NaN without one.
        """
        found = np.array([
            _peak(np.linalg.norm(samples, axis=1) / STANDARD_GRAVITY, times / interval)
            for samples, times in zip(falls, np.stack([impacts, pelvis], axis=1), strict=True)
            ]).reshape(-1, 4)
        return cls(sensor['name'], sensor['bone'], found[:, 0], found[:, 1] * interval,
                   found[:, 2], found[:, 3])

    @property
    def shares_early(self) -> tuple[float, float]:
        """Share of the falls with a first contact that exceed EARLY before it, and share of the
        falls in which the pelvis touches the ground that exceed EARLY before it does.
        """
        return tuple(float((known > EARLY).mean()) if len(known) else 0.0 for known in (
            each[np.isfinite(each)] for each in (self.before_impact, self.before_pelvis)))


def _peak(force: np.ndarray, times: np.ndarray) -> tuple[float, float, float, float]:
    """Largest value, its full width at half maximum in samples, and the largest before each of two
    ``times`` in samples.
    """
    force = force[np.isfinite(force)]
    if not len(force):
        return (np.nan,) * 4
    top = int(force.argmax())
    low = np.flatnonzero(force < force[top] / 2)
    before, after = low[low < top], low[low > top]
    width = (after[0] if len(after) else len(force)) - (before[-1] + 1 if len(before) else 0)
    early = [force[:int(time)] if np.isfinite(time) else force[:0] for time in times]
    return force[top], width, *(part.max() if len(part) else np.nan for part in early)
