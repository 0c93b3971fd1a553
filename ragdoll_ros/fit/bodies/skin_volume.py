"""How much of the volume inside a skin each body has.

A body's triangles are closed by fans where a neighbour's begin, one over each seam; two bodies
share the seam's middle, so that together they have the volume of the whole. What is then left open
where three bodies meet is closed by a fan as well. The volume is by the divergence theorem.
"""
from __future__ import annotations

import numpy as np

from ..reading.character import Character

WELDED = 1e-6
"""Vertices as near as this, of the whole, are one: exporters split them at seams of textures."""


def skin_volumes(character: Character, carriers: np.ndarray, count: int) -> np.ndarray:
    """Volume (count,) m^3 of the skin of each body; ``carriers`` (v,) has each vertex's, or -1.

    Of a skin that is open or flat, what the fans over its rims make of it: little or nothing.
    """
    points, places = _welded(character)
    triangles = places[character.triangles]
    # Of a triangle between bodies: the one with two corners, else the first corner's.
    corner = carriers[character.triangles]
    owners = np.where(corner[:, 1] == corner[:, 2], corner[:, 1], corner[:, 0])
    rims, bodies, others = _seams(triangles, owners, len(points))
    volumes = np.zeros(count)
    for body in range(count):
        mine, own = triangles[owners == body], bodies == body
        cones = [points[mine]] if len(mine) else []
        cones += _fans(points[rims[own]], _labels(rims[own], others[own]))
        volumes[body] = sum(_volume(cone) for cone in cones)
    # A mirrored skin is inside out.
    return volumes * (np.sign(volumes.sum()) or 1.0)


def _welded(character: Character) -> tuple[np.ndarray, np.ndarray]:
    """Points (p, 3) m about their middle, each place once, and the place (v,) of each vertex."""
    vertices = character.vertices - character.vertices.mean(axis=0)
    _, first, places = np.unique(np.round(vertices / (WELDED * character.extent)), axis=0,
                                 return_index=True, return_inverse=True)
    return vertices[first], places.ravel()


def _seams(triangles: np.ndarray, owners: np.ndarray,
           count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Edges (e, 2) where bodies end, the body (e,) of each, and which (e,) is beyond: -1 for none.

    Each edge in the order of its triangle, so that a seam has it once for either side.
    """
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    body = np.tile(owners, 3)
    there, back = edges @ (count, 1), edges @ (1, count)
    order = np.argsort(there, kind='stable')
    found = np.minimum(np.searchsorted(there, back, sorter=order), len(order) - 1)
    beyond = np.where(there[order[found]] == back, body[order[found]], -1)
    rim = (beyond != body) & (edges[:, 0] != edges[:, 1]) & (body >= 0)
    return edges[rim], body[rim], beyond[rim]


def _labels(edges: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Number (e,) of the seam of each edge (e, 2): with one neighbour, and all in one piece."""
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


def _fans(rims: np.ndarray, labels: np.ndarray) -> list[np.ndarray]:
    """Triangles (t, 3, 3) m that close rims (e, 2, 3) m, each seam's by a fan about its middle."""
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
    """Volume between triangles (t, 3, 3) and the origin, m^3, outwards positive."""
    a, b, c = triangles.transpose(1, 0, 2)
    return float(np.einsum('ti,ti->', a, np.cross(b, c)) / 6)
