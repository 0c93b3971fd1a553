"""Which dolls may meet soon: those of whose bones the surrounding balls do."""
from __future__ import annotations

import numpy as np

from ...model.scene import Scene

SPARE = 0.05
"""m that two balls are farther from each other than what moves soon."""

SUDDEN = 2.0
"""Times its speed that an impact may leave a bone with."""


class Neighbours:
    """Balls about the dolls of a scene, a sweep along x over them, and balls about their bones."""

    def __init__(self, scene: Scene, reach: np.ndarray) -> None:
        self._first = np.array([own.start for own in scene.bone_slices])
        self._counts = np.diff([*self._first, len(scene.bones)])
        self._reach = reach
        place = np.arange(self._counts.max())
        self._bones = self._first[:, None] + np.minimum(place, self._counts[:, None] - 1)
        """(d, most) bones of each doll, the last again where there are fewer."""

    def couples(self, rows: np.ndarray, ahead: float, moving: np.ndarray) -> np.ndarray:
        """Pairs (k, 2) of dolls that may touch within ``ahead`` s, in order, one of each at least
        ``moving`` (d,); ``rows`` (n, 13) of all bones.
        """
        speeds = _length(rows[:, 7:10]) + self._reach * _length(rows[:, 10:13])
        balls = self._reach + SUDDEN * ahead * speeds + SPARE / 2
        centres = np.add.reduceat(rows[:, :3], self._first) / self._counts[:, None]
        away = rows[:, :3] - np.repeat(centres, self._counts, axis=0)
        wide = np.maximum.reduceat(_length(away) + balls, self._first)
        a, b = _sweep(centres, wide)
        near = moving[a] | moving[b]
        a, b = a[near], b[near]
        if len(a):
            one, other = self._bones[a], self._bones[b]
            gaps = (_length(rows[one, :3][:, :, None] - rows[other, :3][:, None])
                    - balls[one][:, :, None] - balls[other][:, None, :])
            near = gaps.min(axis=(1, 2)) < 0
            a, b = a[near], b[near]
        found = np.sort(np.stack([a, b], axis=1), axis=1)
        return found[np.lexsort((found[:, 1], found[:, 0]))]


def _sweep(centres: np.ndarray, wide: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which balls (d, 3) m of radius ``wide`` meet, along x first."""
    order = np.argsort(centres[:, 0], kind='stable')
    x, size = centres[order, 0], wide[order]
    counts = np.searchsorted(x, x + size + size.max(), side='right') - np.arange(len(x)) - 1
    one = np.repeat(np.arange(len(x)), counts)
    other = one + 1 + np.arange(len(one)) - np.repeat(np.cumsum(counts) - counts, counts)
    a, b = order[one], order[other]
    near = _length(centres[a] - centres[b]) < wide[a] + wide[b]
    return a[near], b[near]


def _length(vectors: np.ndarray) -> np.ndarray:
    return np.sqrt((vectors * vectors).sum(axis=-1))
