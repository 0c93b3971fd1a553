"""Vertex normals of meshes, smooth with sharp edges."""
from __future__ import annotations

import math

import numpy as np

CREASE = math.radians(40)
"""rad, crease angle: above the 18 degrees between faces of a circle of 20 vertices, below a box's
90."""


def crease_normals(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (3t, 3) m, three to each of ``triangles`` (t, 3), and their unit normals.

    A normal is the mean, weighted by area, of those of the faces around the vertex within CREASE of
    its own face's. Degenerate faces are left out.
    """
    corners = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    full = areas > 1e-9 * areas.max(initial=0.0)
    corners, triangles, normals = corners[full], triangles[full], normals[full]
    units = normals / areas[full, None]
    _, at = np.unique(vertices.round(12), axis=0, return_inverse=True)
    points = at.reshape(-1)[triangles]
    smooth = np.empty_like(corners)
    for point in np.unique(points):
        faces, slots = np.nonzero(points == point)
        near = units[faces] @ units[faces].T > math.cos(CREASE)
        sums = near @ normals[faces]
        smooth[faces, slots] = sums / np.linalg.norm(sums, axis=1, keepdims=True)
    return corners.reshape(-1, 3), smooth.reshape(-1, 3)


def smooth_normals(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Unit normals (v, 3): the triangles' mean around each vertex, weighted by area; else z."""
    corners = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sums = np.stack([np.bincount(triangles.ravel(), np.repeat(component, 3), len(vertices))
                     for component in normals.T], axis=1)
    lengths = np.linalg.norm(sums, axis=1, keepdims=True)
    return np.where(lengths > 1e-30, sums / np.maximum(lengths, 1e-30), (0.0, 0.0, 1.0))
