"""Which dolls may meet soon: those of whose bones the surrounding balls do.

How fast two dolls may come nearer does not depend on how fast both of them fall, unless the ground
may throw one of them sideways: then their speeds count as the ground sees them.
"""
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
        self._reach, self._ground = reach, scene.ground
        place = np.arange(self._counts.max())
        self._bones = self._first[:, None] + np.minimum(place, self._counts[:, None] - 1)
        """(d, most) bones of each doll, the last again where there are fewer."""

    def couples(self, rows: np.ndarray, ahead: float, moving: np.ndarray,
                groups: np.ndarray) -> np.ndarray:
        """Pairs (k, 2) of dolls that may touch within ``ahead`` s, in order, one of each at least
        ``moving`` (d,); ``rows`` (n, 13) of all bones, ``groups`` (d,) what goes on together.
        """
        ahead *= SUDDEN
        centres, drifts = (self._mean(rows[:, own]) for own in (slice(0, 3), slice(7, 10)))
        away, apart = (rows[:, own] - np.repeat(means, self._counts, axis=0) for own, means in (
            (slice(0, 3), centres), (slice(7, 10), drifts)))
        turning = self._reach * _length(rows[:, 10:13])
        balls = self._reach + SPARE / 2 + ahead * (_length(apart) + turning)
        wide = np.maximum.reduceat(_length(away) + balls, self._first)
        bound = self._near_ground(rows, balls, ahead * _length(drifts), groups)
        a, b = _sweep(centres, wide + ahead * _spread(drifts, bound))
        near = moving[a] | moving[b]
        a, b = a[near], b[near]
        closing = ahead * _closing(drifts, bound, a, b)
        near = _length(centres[a] - centres[b]) < wide[a] + wide[b] + closing
        a, b, closing = a[near], b[near], closing[near]
        if len(a):
            one, other = self._bones[a], self._bones[b]
            gaps = (_length(rows[one, :3][:, :, None] - rows[other, :3][:, None])
                    - balls[one][:, :, None] - balls[other][:, None, :])
            near = gaps.min(axis=(1, 2)) < closing
            a, b = a[near], b[near]
        found = np.sort(np.stack([a, b], axis=1), axis=1)
        return found[np.lexsort((found[:, 1], found[:, 0]))]

    def _mean(self, values: np.ndarray) -> np.ndarray:
        """Means (d, 3) over the bones of each doll."""
        return np.add.reduceat(values, self._first) / self._counts[:, None]

    def _near_ground(self, rows: np.ndarray, balls: np.ndarray, ways: np.ndarray,
                     groups: np.ndarray) -> np.ndarray:
        """Which dolls (d,) may be at the ground when they have moved by ``ways`` (d,) m, they or
        one of their group, which may hand on how the ground throws it.
        """
        if self._ground is None:
            return np.zeros(len(ways), bool)
        heights = rows[:, :3] @ np.array(self._ground.normal) - self._ground.offset
        near = np.minimum.reduceat(heights - balls, self._first) < ways
        return (np.bincount(groups, near) > 0)[groups]


def _closing(drifts: np.ndarray, bound: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """How fast (k,) m/s dolls that drift (d, 3) may come nearer, where the ground binds (d,)."""
    speeds = _length(drifts)
    return np.where(bound[a] | bound[b], speeds[a] + speeds[b], _length(drifts[a] - drifts[b]))


def _spread(drifts: np.ndarray, bound: np.ndarray) -> np.ndarray:
    """Speeds (d,) m/s of which two dolls' together are no less than they may come nearer by.

    They are those against a common velocity w: |v - u| <= |v - w| + |u - w|, and where the ground
    binds u, |v| + |u| <= |v - w| + (|u| + |w|).
    """
    common = np.where(bound[:, None], 0.0, drifts).mean(axis=0)
    return np.where(bound, _length(drifts) + _length(common), _length(drifts - common))


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
