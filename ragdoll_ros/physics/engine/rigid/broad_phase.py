"""Broad phase: pairs of dolls whose bones' bounding spheres, swept over time, overlap.

Speeds count relative to each other, so that dolls that fall side by side do not pair. Where the
ground may deflect one of two dolls, its speed counts relative to the ground.
"""
from __future__ import annotations

import numpy as np

from ....model.scene import Scene

MARGIN = 0.05
"""m that is added to the distance at which spheres overlap."""

IMPACT_SPEEDUP = 2.0
"""Largest speed after an impact, as a multiple of the speed before."""

NO_PAIRS = np.zeros((0, 2), np.int64)


class BroadPhase:
    """Sweep and prune along x over spheres around dolls, then spheres around their bones."""

    def __init__(self, scene: Scene, reach: np.ndarray) -> None:
        self._first = np.array([own.start for own in scene.bone_slices])
        self._counts = np.diff([*self._first, len(scene.bones)])
        self._reach, self._ground = reach, scene.ground
        place = np.arange(self._counts.max())
        self._bones = self._first[:, None] + np.minimum(place, self._counts[:, None] - 1)
        """(d, k) bones of each doll, padded with its last bone."""

    def pairs(self, states: np.ndarray, ahead: float, moving: np.ndarray,
              clusters: np.ndarray) -> np.ndarray:
        """Pairs (k, 2) of dolls that may touch within ``ahead`` s, sorted, of which one or both are
        ``moving`` (d,). ``states`` (n, 13) of all bones; ``clusters`` (d,): cluster index of each
        doll.
        """
        ahead *= IMPACT_SPEEDUP
        centers, mean_velocities = (self._mean(states[:, own])
                                    for own in (slice(0, 3), slice(7, 10)))
        radii = self._bone_spheres(states, mean_velocities, ahead)
        away = _length(states[:, :3] - np.repeat(centers, self._counts, axis=0))
        doll_radii = np.maximum.reduceat(away + radii, self._first, axis=1)
        deflected = self._deflected(states, radii[1], clusters)
        a, b = _sweep(centers, _sweep_radii(doll_radii, ahead * mean_velocities, deflected))
        near = moving[a] | moving[b]
        if not near.any():
            return NO_PAIRS
        a, b = a[near], b[near]
        relative_to_ground = (deflected[a] | deflected[b]).astype(int)
        """(k,) whether speeds count relative to the ground, 1, not each other, 0: row of radii."""
        closing = np.where(relative_to_ground, 0.0,
                           ahead * _length(mean_velocities[a] - mean_velocities[b]))
        near = _length(centers[a] - centers[b]) < (
            doll_radii[relative_to_ground, a] + doll_radii[relative_to_ground, b] + closing)
        a, b, closing = a[near], b[near], closing[near]
        relative_to_ground = relative_to_ground[near, None]
        if len(a):
            one, other = self._bones[a], self._bones[b]
            gaps = (_length(states[one, :3][:, :, None] - states[other, :3][:, None])
                    - radii[relative_to_ground, one][:, :, None]
                    - radii[relative_to_ground, other][:, None, :])
            near = gaps.min(axis=(1, 2)) < closing
            a, b = a[near], b[near]
        found = np.sort(np.stack([a, b], axis=1), axis=1)
        return found[np.lexsort((found[:, 1], found[:, 0]))]

    def _mean(self, values: np.ndarray) -> np.ndarray:
        """Means (d, 3) over the bones of each doll."""
        return np.add.reduceat(values, self._first) / self._counts[:, None]

    def _bone_spheres(self, states: np.ndarray, mean_velocities: np.ndarray,
                      ahead: float) -> np.ndarray:
        """Radii (2, n) m of spheres that contain the bones for ``ahead`` s, in the frames of the
        ``mean_velocities`` (d, 3) m/s of their dolls, and of the ground.
        """
        own = states[:, 7:10] - np.repeat(mean_velocities, self._counts, axis=0)
        turning = self._reach * _length(states[:, 10:13])
        return np.array([self._reach + ahead * (_length(velocities) + turning) + MARGIN / 2
                         for velocities in (own, states[:, 7:10])])

    def _deflected(self, states: np.ndarray, radii: np.ndarray, clusters: np.ndarray) -> np.ndarray:
        """Which dolls (d,) the ground may deflect: whose spheres of ``radii`` (n,) m reach it, and
        the others of their clusters.
        """
        if self._ground is None:
            return np.zeros(len(clusters), bool)
        heights = (states[:, :3] * self._ground.normal).sum(axis=1) - self._ground.offset
        near = np.minimum.reduceat(heights - radii, self._first) < 0
        return (np.bincount(clusters, near) > 0)[clusters]


def _sweep_radii(doll_radii: np.ndarray, displacements: np.ndarray,
                 deflected: np.ndarray) -> np.ndarray:
    """Radii (d,) m of spheres at rest around dolls that overlap wherever those of ``doll_radii``
    (2, d) m, swept along the ``displacements`` (d, 3) m, do.

    For displacements u and v, and a common one w: |u - v| <= |u - w| + |v - w|. Where speeds count
    relative to the ground, as one of a pair may be ``deflected``, the other one's sphere may be
    wider by |u|; but |u| <= |u - w| + |w|, and |w| is added to the deflected one.
    """
    common = np.where(deflected[:, None], 0.0, displacements).mean(axis=0)
    return np.where(deflected, doll_radii[1] + _length(common),
                    doll_radii[0] + _length(displacements - common))


def _sweep(centers: np.ndarray, radii: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of spheres of these ``radii`` (d,) m that overlap: sorted along x, then compared."""
    order = np.argsort(centers[:, 0], kind='stable')
    x, size = centers[order, 0], radii[order]
    counts = np.searchsorted(x, x + size + size.max(), side='right') - np.arange(len(x)) - 1
    one = np.repeat(np.arange(len(x)), counts)
    other = one + 1 + np.arange(len(one)) - np.repeat(np.cumsum(counts) - counts, counts)
    a, b = order[one], order[other]
    near = _length(centers[a] - centers[b]) < radii[a] + radii[b]
    return a[near], b[near]


def _length(vectors: np.ndarray) -> np.ndarray:
    return np.sqrt((vectors * vectors).sum(axis=-1))
