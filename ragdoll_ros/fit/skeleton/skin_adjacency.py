"""Adjacency of bones by their skin: area that two bones move together, and distances."""
from dataclasses import dataclass

import numpy as np

from ..reading.character import Character

COINCIDENT = 1e-5
"""Vertices closer than this fraction of the character's extent coincide."""

SAMPLES, MIN_SAMPLES = 4000, 24
"""Points sampled from all clusters together, and at least from each, to measure distances."""

ROWS = 32
"""Points whose distances to all others are computed at once: these numbers stay in the processor's
cache, and their product is too small for threads, whose start would take longer."""


@dataclass(frozen=True)
class SkinAdjacency:
    """Skin shared by each pair of n bones."""

    shared_area: np.ndarray
    """(n, n) m^2 that two bones move together; symmetric, zero on the diagonal."""
    area_moments: np.ndarray
    """(n, n, 3) m^3: centroid of that skin, times its area."""

    def centroid(self, a: int, b: int) -> np.ndarray | None:
        """Centroid (3,) m of the skin that two bones share, None where they share none."""
        area = self.shared_area[a, b]
        return self.area_moments[a, b] / area if area > 0 else None


def find_adjacency(character: Character) -> SkinAdjacency:
    """Shared skin of all pairs of bones.

    Each edge of the mesh counts with its area times the weights at both ends. So bones are adjacent
    where an edge connects their skins or where both move a vertex. Coincident vertices, as at
    texture seams and between meshes, are connected by an edge.
    """
    ends, areas = _weighted_edges(character)
    middles = character.vertices[ends].mean(axis=1)
    count, width = len(character.bone_names), character.bones.shape[1]
    area, moments = np.zeros(count * count), np.zeros((count * count, 3))
    for i in range(width):
        for k in range(width):
            a, b = character.bones[ends[:, 0], i], character.bones[ends[:, 1], k]
            both = character.weights[ends[:, 0], i] * character.weights[ends[:, 1], k] * areas
            used = np.flatnonzero((both > 0) & (a != b))
            pair = a[used].astype(np.int64) * count + b[used]
            area += np.bincount(pair, both[used], count * count)
            for axis in range(3):
                moments[:, axis] += np.bincount(pair, both[used] * middles[used, axis],
                                                count * count)
    area, moments = area.reshape(count, count), moments.reshape(count, count, 3)
    return SkinAdjacency(area + area.T, moments + moments.transpose(1, 0, 2))


def _weighted_edges(character: Character) -> tuple[np.ndarray, np.ndarray]:
    """Edges (e, 2) of the skin as vertex indices, and the area (e,) m^2 of each."""
    triangles = character.triangles
    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    grid = np.round(character.vertices / (COINCIDENT * character.extent)).astype(np.int64)
    order = np.lexsort(grid.T)
    equal = (grid[order[1:]] == grid[order[:-1]]).all(axis=1)
    seams = np.stack([order[:-1], order[1:]], axis=1)[equal]
    own = character.vertex_areas()
    return (np.concatenate([ends, seams]),
            np.concatenate([np.repeat(character.corner_areas(), 3),
                            own[seams].min(axis=1, initial=np.inf)]))


def cluster_distances(character: Character, clusters: list[np.ndarray]) -> np.ndarray:
    """Distances (n, n) m between the clusters of n bones; infinite for an empty cluster."""
    count = len(clusters)
    held = [bone for bone in range(count) if len(clusters[bone])]
    most = max(MIN_SAMPLES, SAMPLES // max(1, len(held)))
    chosen = [clusters[bone][::-(-len(clusters[bone]) // most)] for bone in held]
    starts = np.cumsum([0, *(len(part) for part in chosen[:-1])])
    points = character.vertices[np.concatenate(chosen)]
    squares = (points ** 2).sum(axis=1)
    distances = np.full((count, count), np.inf)
    for index, (first, part) in enumerate(zip(starts, chosen, strict=True)):
        # To itself and to those after it: the matrix is symmetric.
        others, lengths = points[first:], squares[first:]
        nearest = np.full(len(others), np.inf)
        for own in np.split(others[:len(part)], range(ROWS, len(part), ROWS)):
            np.minimum(nearest, _squares(own, others, lengths).min(axis=0), out=nearest)
        distances[held[index], held[index:]] = np.minimum.reduceat(
            np.sqrt(np.maximum(nearest, 0)), starts[index:] - first)
    return np.minimum(distances, distances.T)


def _squares(a: np.ndarray, b: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Squared distances (m, n) m^2 between points (m, 3) and (n, 3) of squared lengths (n,)."""
    products = 2 * a @ b.T
    return np.subtract((a ** 2).sum(axis=1)[:, None] + lengths, products, out=products)


def nearest_midpoint(character: Character, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Midpoint (3,) m between two clusters of vertices where they are nearest to each other."""
    a, b = (character.vertices[part[::-(-len(part) // 1000)]] for part in (first, second))
    lengths = (b ** 2).sum(axis=1)
    blocks = [_squares(own, b, lengths) for own in np.split(a, range(ROWS, len(a), ROWS))]
    # Within 1 % of the extent of the nearest pair, so that a ring gives its centre.
    least = max(min(block.min() for block in blocks), 0)
    near = [block <= (np.sqrt(least) + 0.01 * character.extent) ** 2 for block in blocks]
    rows, columns = np.nonzero(np.concatenate(near))
    return (a[rows].mean(axis=0) + b[columns].mean(axis=0)) / 2
