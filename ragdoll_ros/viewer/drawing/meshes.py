"""Unit meshes, to be scaled: a box, a cylinder along z, a sphere.

Vertices (v, 3) m and faces (f, 3), counter-clockwise seen from outside. Shading uses vertex
normals, so sharp edges have separate vertices for each face, and soft ones share them.
"""
from __future__ import annotations

import numpy as np

Mesh = tuple[np.ndarray, np.ndarray]

SEGMENTS = 24
"""Of a circle."""

EDGE = 0.06
"""Width of the strip along a box's edges, relative to its size, that is shaded as if it were round.
Its corners share their vertices, and thereby normals; the shape remains a box."""


def box() -> Mesh:
    """A box with edges of 1 m, of flat faces."""
    corners, faces = [], []
    for axis in range(3):
        u, w = np.eye(3)[[(axis + 1) % 3, (axis + 2) % 3]]
        for sign in (1, -1):
            first = len(corners)
            corners += [(np.eye(3)[axis] * sign + a * u + b * sign * w) / 2
                        for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
            faces += [(first, first + 1, first + 2), (first, first + 2, first + 3)]
    return np.array(corners), np.array(faces)


def faceted(vertices: np.ndarray, faces: np.ndarray) -> Mesh:
    """A mesh whose faces are shaded flat: none shares a vertex."""
    return vertices[faces].reshape(-1, 3), np.arange(faces.size).reshape(-1, 3)


def soft_box() -> Mesh:
    """A box with edges of 1 m, shaded as if its edges were rounded."""
    corners, _ = box()
    outer, shared = np.unique(corners, axis=0, return_inverse=True)
    inner = corners.copy()
    faces = []
    for first in range(0, 24, 4):
        axis = int(np.argmin(np.ptp(corners[first:first + 4], axis=0)))
        inside = np.delete(np.arange(3), axis)
        inner[first:first + 4, inside] *= 1 - 2 * EDGE
        at = np.arange(first, first + 4) + len(outer)
        edge = shared.ravel()[first:first + 4]
        faces += [(at[0], at[1], at[2]), (at[0], at[2], at[3])]
        for k in range(4):
            after = (k + 1) % 4
            faces += [(edge[k], edge[after], at[after]), (edge[k], at[after], at[k])]
    return np.concatenate([outer, inner]), np.array(faces)


def cylinder(corners: int = SEGMENTS) -> Mesh:
    """A cylinder of 1 m diameter and 1 m length."""
    angle = np.arange(corners) * 2 * np.pi / corners
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(corners)], axis=1) / 2
    up = np.array([0, 0, 0.5])
    low, high = ring - up, ring + up
    at, after = np.arange(corners), (np.arange(corners) + 1) % corners
    side = [np.stack([at, after, after + corners], axis=1),
            np.stack([at, after + corners, at + corners], axis=1)]
    fan = np.stack([np.zeros(corners - 2, int), at[1:-1], at[2:]], axis=1)
    caps = [fan[:, ::-1] + 2 * corners, fan + 3 * corners]
    return np.concatenate([low, high, low, high]), np.concatenate(side + caps)


def sphere(corners: int = SEGMENTS) -> Mesh:
    """A sphere of 1 m diameter, as latitude and longitude grid."""
    rows = corners // 2
    tilt = np.arange(rows + 1)[:, None] * np.pi / rows
    angle = np.arange(corners)[None] * 2 * np.pi / corners
    points = np.stack(np.broadcast_arrays(
        np.sin(tilt) * np.cos(angle), np.sin(tilt) * np.sin(angle), np.cos(tilt)), axis=-1) / 2
    row, at = (index.ravel() for index in np.mgrid[:rows, :corners])
    after = (at + 1) % corners
    a, b, c, d = (r * corners + p for r, p in ((row, at), (row + 1, at), (row + 1, after),
                                             (row, after)))
    faces = np.concatenate([np.stack([a, b, c], axis=1)[row < rows - 1],
                            np.stack([a, c, d], axis=1)[row > 0]])
    return points.reshape(-1, 3), faces


MESHES = {'box': soft_box(), 'cylinder': cylinder(), 'sphere': sphere()}
"""By the kinds of primitives in model.shapes."""

COARSE = {'box': box(), 'cylinder': cylinder(SEGMENTS // 2), 'sphere': sphere(SEGMENTS // 2)}
"""For crowds, whose heads are most of the triangles: a quarter of these."""
