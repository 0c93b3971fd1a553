"""Where the skins of two bones meet: how much of it both move, and how far apart they are."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..reading.character import Character

EQUAL = 1e-5
"""Vertices are one if they are this near to each other, of the whole character."""

SAMPLES, FEWEST_SAMPLES = 4000, 24
"""Points of all clusters together, and of one, between which gaps are looked for."""


@dataclass(frozen=True)
class Borders:
    """What n bones share of the skin."""

    shared: np.ndarray
    """(n, n) m^2 of skin that two bones move together; symmetric, zero on the diagonal."""
    sums: np.ndarray
    """(n, n, 3) m^3: the middles of that skin, times its area."""

    def middle(self, a: int, b: int) -> np.ndarray | None:
        """Middle (3,) m of the skin that two bones share, None where they share none."""
        return self.sums[a, b] / self.shared[a, b] if self.shared[a, b] > 0 else None


def find_borders(character: Character) -> Borders:
    """Borders of all bones; an edge of the skin counts by the weights at its two ends.

    So bones meet where an edge goes from one's skin to the other's as well as where both move the
    same vertex. Equal vertices, as they are along seams and between meshes, are joined by an edge.
    """
    ends, areas = _edges(character)
    middles = character.vertices[ends].mean(axis=1)
    count, width = len(character.bone_names), character.bones.shape[1]
    shared, sums = np.zeros(count * count), np.zeros((count * count, 3))
    for i in range(width):
        for k in range(width):
            a, b = character.bones[ends[:, 0], i], character.bones[ends[:, 1], k]
            both = (character.weights[ends[:, 0], i] * character.weights[ends[:, 1], k]
                    * areas)
            used = np.flatnonzero((both > 0) & (a != b))
            pair = a[used].astype(np.int64) * count + b[used]
            shared += np.bincount(pair, both[used], count * count)
            for axis in range(3):
                sums[:, axis] += np.bincount(pair, both[used] * middles[used, axis], count * count)
    shared, sums = shared.reshape(count, count), sums.reshape(count, count, 3)
    return Borders(shared + shared.T, sums + sums.transpose(1, 0, 2))


def _edges(character: Character) -> tuple[np.ndarray, np.ndarray]:
    """Edges (e, 2) of the skin by their vertices, and the area (e,) m^2 that each stands for."""
    triangles = character.triangles
    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    grid = np.round(character.vertices / (EQUAL * character.extent)).astype(np.int64)
    order = np.lexsort(grid.T)
    equal = (grid[order[1:]] == grid[order[:-1]]).all(axis=1)
    seams = np.stack([order[:-1], order[1:]], axis=1)[equal]
    own = character.vertex_areas()
    return (np.concatenate([ends, seams]),
            np.concatenate([np.repeat(character.corner_areas(), 3),
                            own[seams].min(axis=1, initial=np.inf)]))


def find_gaps(character: Character, clusters: list[np.ndarray]) -> np.ndarray:
    """Distances (n, n) m between the clusters of bones; infinite for a bone without one."""
    count = len(clusters)
    held = [bone for bone in range(count) if len(clusters[bone])]
    most = max(FEWEST_SAMPLES, SAMPLES // max(1, len(held)))
    chosen = [clusters[bone][::-(-len(clusters[bone]) // most)] for bone in held]
    starts = np.cumsum([0, *(len(part) for part in chosen[:-1])])
    points = character.vertices[np.concatenate(chosen)]
    gaps = np.full((count, count), np.inf)
    for bone, part in zip(held, chosen, strict=True):
        own = character.vertices[part]
        squares = ((own ** 2).sum(axis=1)[:, None] + (points ** 2).sum(axis=1)
                   - 2 * own @ points.T)
        nearest = np.sqrt(np.maximum(squares.min(axis=0), 0))
        gaps[bone, held] = np.minimum.reduceat(nearest, starts)
    return np.minimum(gaps, gaps.T)


def nearest_points(character: Character, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Middle (3,) m between two clusters of vertices where they are nearest to each other."""
    a, b = (character.vertices[part[::-(-len(part) // 1000)]] for part in (first, second))
    squares = (a ** 2).sum(axis=1)[:, None] + (b ** 2).sum(axis=1) - 2 * a @ b.T
    # All that is as near, to a hundredth of the whole, so that a ring gives its middle.
    near = squares <= (np.sqrt(max(squares.min(), 0)) + 0.01 * character.extent) ** 2
    rows, columns = np.nonzero(near)
    return (a[rows].mean(axis=0) + b[columns].mean(axis=0)) / 2
