"""Volume that the skin of each body encloses, by the divergence theorem.

The triangles of a body form an open surface. A triangle fan caps each boundary with a neighbour;
both bodies share the fan's centre, so that the volumes add up to that of the whole skin. Another
fan caps what remains open where three bodies meet.
"""
from __future__ import annotations

import numpy as np

from ..reading.character import Character

WELD_TOLERANCE = 1e-6
"""Vertices closer than this fraction of the extent are one: exporters split texture seams."""


def skin_volumes(character: Character, carriers: np.ndarray, count: int) -> np.ndarray:
    """Skin volume (count,) m^3 of each body; ``carriers`` (v,) is each vertex's body, or -1.

    Near zero where the skin is open or flat.
    """
    points, places = _weld_vertices(character)
    triangles = places[character.triangles]
    # A triangle across a boundary belongs to the body with two corners, else to the first corner's.
    corner = carriers[character.triangles]
    owners = np.where(corner[:, 1] == corner[:, 2], corner[:, 1], corner[:, 0])
    rims, bodies, others = _boundary_edges(triangles, owners, len(points))
    volumes = np.zeros(count)
    for body in range(count):
        mine, own = triangles[owners == body], bodies == body
        cones = [points[mine]] if len(mine) else []
        cones += _cap_boundaries(points[rims[own]], _boundary_loops(rims[own], others[own]))
        volumes[body] = sum(_volume(cone) for cone in cones)
    # A mirrored skin has its triangles inside out.
    return volumes * (np.sign(volumes.sum()) or 1.0)


def _weld_vertices(character: Character) -> tuple[np.ndarray, np.ndarray]:
    """Unique points (p, 3) m about their mean, and the point index (v,) of each vertex."""
    vertices = character.vertices - character.vertices.mean(axis=0)
    _, first, places = np.unique(np.round(vertices / (WELD_TOLERANCE * character.extent)), axis=0,
                                 return_index=True, return_inverse=True)
    return vertices[first], places.ravel()


def _boundary_edges(triangles: np.ndarray, owners: np.ndarray,
                    count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Boundary edges (e, 2) of the bodies, each edge's body (e,) and neighbour (e,), -1 for none.

    Edges keep the winding of their triangle, so a boundary between two bodies appears twice.
    """
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    body = np.tile(owners, 3)
    there, back = edges @ (count, 1), edges @ (1, count)
    order = np.argsort(there, kind='stable')
    found = np.minimum(np.searchsorted(there, back, sorter=order), len(order) - 1)
    beyond = np.where(there[order[found]] == back, body[order[found]], -1)
    rim = (beyond != body) & (edges[:, 0] != edges[:, 1]) & (body >= 0)
    return edges[rim], body[rim], beyond[rim]


def _boundary_loops(edges: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Label (e,) of each edge's (e, 2) boundary: connected, and with one neighbour."""
    heads: dict[tuple[int, int], tuple[int, int]] = {}

    def head(key: tuple[int, int]) -> tuple[int, int]:
        while heads.setdefault(key, key) != key:
            heads[key] = key = heads[heads[key]]
        return key

    keys = [((int(a), int(other)), (int(b), int(other)))
            for (a, b), other in zip(edges, others, strict=True)]
    for a, b in keys:
        heads[head(a)] = head(b)
    return np.unique([head(a) for a, _ in keys], axis=0, return_inverse=True)[1].ravel() \
        if keys else np.zeros(0, int)


def _cap_boundaries(rims: np.ndarray, labels: np.ndarray) -> list[np.ndarray]:
    """Triangles (t, 3, 3) m that cap the boundary edges (e, 2, 3) m, one fan for each label."""
    fans, open_ = [], []
    for label in range(labels.max(initial=-1) + 1):
        edges = rims[labels == label]
        middle = edges.mean(axis=(0, 1))
        fans.append(_fan(edges, middle))
        starts, ends = ({tuple(point) for point in edges[:, end]} for end in (0, 1))
        open_ += [(point, middle) for point in starts - ends]
        open_ += [(middle, point) for point in ends - starts]
    if open_:
        left = np.array(open_)
        fans.append(_fan(left, left.mean(axis=(0, 1))))
    return fans


def _fan(edges: np.ndarray, middle: np.ndarray) -> np.ndarray:
    return np.stack([edges[:, 1], edges[:, 0], np.broadcast_to(middle, edges[:, 0].shape)], axis=1)


def _volume(triangles: np.ndarray) -> float:
    """Volume between triangles (t, 3, 3) m and the origin, m^3, positive for outward normals."""
    a, b, c = triangles.transpose(1, 0, 2)
    return float(np.einsum('ti,ti->', a, np.cross(b, c)) / 6)
