"""Which dolls may meet soon: those of whose bones the surrounding balls do.

How fast two dolls may come nearer does not depend on how fast both of them fall, unless the ground
may throw one of them sideways: then their speeds count as the ground sees them.
"""
from __future__ import annotations

import numpy as np

from ....model.scene import Scene

SPARE = 0.05
"""m that two balls are farther from each other than what moves soon."""

SUDDEN = 2.0
"""Times its speed that an impact may leave a bone with."""


NO_COUPLES = np.zeros((0, 2), np.int64)


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
        balls = self._balls(rows, drifts, ahead)
        away = _length(rows[:, :3] - np.repeat(centres, self._counts, axis=0))
        wide = np.maximum.reduceat(away + balls, self._first, axis=1)
        thrown = self._near_ground(rows, balls[1], groups)
        a, b = _sweep(centres, _enough(wide, ahead * drifts, thrown))
        near = moving[a] | moving[b]
        if not near.any():
            return NO_COUPLES
        a, b = a[near], b[near]
        seen = (thrown[a] | thrown[b]).astype(int)
        """(k,) against what the speeds of two dolls count: 0 each other, 1 the ground."""
        closing = np.where(seen, 0.0, ahead * _length(drifts[a] - drifts[b]))
        near = _length(centres[a] - centres[b]) < wide[seen, a] + wide[seen, b] + closing
        a, b, seen, closing = a[near], b[near], seen[near, None], closing[near]
        if len(a):
            one, other = self._bones[a], self._bones[b]
            gaps = (_length(rows[one, :3][:, :, None] - rows[other, :3][:, None])
                    - balls[seen, one][:, :, None] - balls[seen, other][:, None, :])
            near = gaps.min(axis=(1, 2)) < closing
            a, b = a[near], b[near]
        found = np.sort(np.stack([a, b], axis=1), axis=1)
        return found[np.lexsort((found[:, 1], found[:, 0]))]

    def _mean(self, values: np.ndarray) -> np.ndarray:
        """Means (d, 3) over the bones of each doll."""
        return np.add.reduceat(values, self._first) / self._counts[:, None]

    def _balls(self, rows: np.ndarray, drifts: np.ndarray, ahead: float) -> np.ndarray:
        """Radii (2, n) m about bones: of where they get to against their dolls' drift (d, 3) m/s,
        and against the ground.
        """
        own = rows[:, 7:10] - np.repeat(drifts, self._counts, axis=0)
        turning = self._reach * _length(rows[:, 10:13])
        return np.array([self._reach + ahead * (_length(velocities) + turning) + SPARE / 2
                         for velocities in (own, rows[:, 7:10])])

    def _near_ground(self, rows: np.ndarray, balls: np.ndarray, groups: np.ndarray) -> np.ndarray:
        """Which dolls (d,) the ground may throw: whose ``balls`` (n,) m reach it, and those that
        go on with such a one, which may hand it on.
        """
        if self._ground is None:
            return np.zeros(len(groups), bool)
        heights = (rows[:, :3] * self._ground.normal).sum(axis=1) - self._ground.offset
        near = np.minimum.reduceat(heights - balls, self._first) < 0
        return (np.bincount(groups, near) > 0)[groups]


def _enough(wide: np.ndarray, ways: np.ndarray, thrown: np.ndarray) -> np.ndarray:
    """Radii (d,) m of balls about dolls that meet wherever those of radii ``wide`` (2, d) do.

    For dolls that go ways (d, 3) m of u and v, and a common way w: |u - v| <= |u - w| + |v - w|.
    Where the ground counts for a pair, as one of it may be ``thrown``, the other one's ball may be
    wider by |u|; but |u| <= |u - w| + |w|, and |w| is added to the thrown one.
    """
    common = np.where(thrown[:, None], 0.0, ways).mean(axis=0)
    return np.where(thrown, wide[1] + _length(common), wide[0] + _length(ways - common))


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
