"""Which dolls may meet soon: those whose surrounding balls do."""
from __future__ import annotations

import numpy as np

from ...model.scene import Scene

SPARE = 0.05
"""m that balls are wider than what moves within a tick."""


class Neighbours:
    """Balls about the dolls of a scene, and a sweep along x over them."""

    def __init__(self, scene: Scene, reach: np.ndarray) -> None:
        self._first = np.array([own.start for own in scene.bone_slices])
        self._counts = np.diff([*self._first, len(scene.bones)])
        self._reach = reach

    def couples(self, rows: np.ndarray, ahead: float, moving: np.ndarray) -> np.ndarray:
        """Pairs (k, 2) of dolls that may touch within ``ahead`` s, in order, one of each at least
        ``moving`` (d,); ``rows`` (n, 13) of all bones.
        """
        centres = np.add.reduceat(rows[:, :3], self._first) / self._counts[:, None]
        away = rows[:, :3] - np.repeat(centres, self._counts, axis=0)
        radii = np.maximum.reduceat(_length(away) + self._reach, self._first)
        speeds = np.maximum.reduceat(
            _length(rows[:, 7:10]) + self._reach * _length(rows[:, 10:13]), self._first)
        wide = radii + 2 * speeds * ahead + SPARE / 2
        order = np.argsort(centres[:, 0], kind='stable')
        x, size = centres[order, 0], wide[order]
        ends = np.searchsorted(x, x + size + size.max(), side='right')
        counts = ends - np.arange(len(x)) - 1
        one = np.repeat(np.arange(len(x)), counts)
        other = one + 1 + np.arange(len(one)) - np.repeat(np.cumsum(counts) - counts, counts)
        a, b = order[one], order[other]
        near = (_length(centres[a] - centres[b]) < wide[a] + wide[b]) & (moving[a] | moving[b])
        found = np.sort(np.stack([a[near], b[near]], axis=1), axis=1)
        return found[np.lexsort((found[:, 1], found[:, 0]))]


def _length(vectors: np.ndarray) -> np.ndarray:
    return np.sqrt((vectors * vectors).sum(axis=-1))
