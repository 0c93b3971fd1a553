"""Tables of convex hulls, as the kernels read them."""
from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ....model.mesh import Hull
from ....model.pose import Pose
from ...kernels.collision.shapes import HULL
from ...kernels.system import GEOM, HULL_EDGE, HULL_FACE, HULL_TABLE, HULL_VERTEX

ONE_PLANE = 1e-9
"""Difference of normals, and of distances over the hull's size, up to which faces are one."""


class HullTables(NamedTuple):
    """Fields of a System of the same names: HULL_VERTEX (k,), HULL_FACE (t,), HULL_EDGE (e,),
    indices (m,) and HULL_TABLE (h,).
    """

    hull_vertices: np.ndarray
    hull_faces: np.ndarray
    hull_edges: np.ndarray
    hull_indices: np.ndarray
    hulls: np.ndarray


NO_HULLS = HullTables(np.zeros(0, HULL_VERTEX), np.zeros(0, HULL_FACE), np.zeros(0, HULL_EDGE),
                      np.zeros(0, np.int64), np.zeros(0, HULL_TABLE))


def hull_tables(hull: Hull) -> HullTables:
    """Tables of one hull, with its centroid as the origin."""
    triangles = hull.triangles
    corners = triangles.corners - hull.centroid
    vertices, place = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    order = np.lexsort(vertices.T)
    faces = np.zeros(len(corners), HULL_FACE)
    faces['corners'] = np.argsort(order)[place.reshape(-1, 3)]
    faces['normal'] = triangles.normals
    # The support function, so that no vertex is outside.
    faces['offset'] = [(vertices @ normal).max() for normal in triangles.normals]
    radius = np.linalg.norm(vertices, axis=1).max()
    faces, groups = _by_faces(faces, radius)
    vertices = vertices[order]
    edges = _edges(vertices, faces)
    table = np.zeros(1, HULL_TABLE)
    table['vertex_count'], table['face_count'] = len(vertices), len(groups)
    table['triangle_count'], table['edge_count'], table['size'] = len(faces), len(edges), radius
    table['extremes'] = np.stack([vertices.argmax(axis=0), vertices.argmin(axis=0)], axis=1).ravel()
    ends = np.concatenate([faces['corners'], np.roll(faces['corners'], -1, axis=1)], axis=1)
    begin, end = np.unique(ends[:, [0, 3, 1, 4, 2, 5]].reshape(-1, 2), axis=0).T
    records = np.zeros(len(vertices), HULL_VERTEX)
    records['point'], records['neighbor_count'] = vertices, np.bincount(begin)
    records['first_neighbor'] = np.cumsum(records['neighbor_count']) - records['neighbor_count']
    polygons = [_boundary(faces['corners'][group]) for group in groups]
    faces['corner_count'][:len(groups)] = sizes = [len(polygon) for polygon in polygons]
    faces['first_corner'][:len(groups)] = len(end) + np.cumsum(sizes) - sizes
    return HullTables(records, faces, edges, np.concatenate([end, *polygons]), table)


def hull_geom(hull: Hull, pose: Pose) -> np.ndarray:
    """GEOM (1,) of a hull at a pose, but for body, law and indices."""
    geom = np.zeros(1, GEOM)
    radius = np.linalg.norm(hull.vertices - hull.centroid, axis=1).max()
    geom['kind'], geom['size'] = HULL, (radius, 0, 0)
    geom['position'], geom['orientation'] = pose.apply(np.array(hull.centroid)), pose.orientation
    geom['bounding_radius'] = radius
    geom['reach'] = np.linalg.norm(pose.apply(hull.vertices), axis=1).max()
    return geom


def join_hulls(parts: Sequence[HullTables]) -> HullTables:
    """Concatenate tables: the hulls of each follow those of the one before."""
    vertices = faces = edges = indices = 0
    moved = []
    for part in parts:
        table = part.hulls.copy()
        table['first_vertex'] += vertices
        table['first_face'] += faces
        table['first_edge'] += edges
        table['first_index'] += indices
        moved.append(table)
        vertices, faces = vertices + len(part.hull_vertices), faces + len(part.hull_faces)
        edges, indices = edges + len(part.hull_edges), indices + len(part.hull_indices)
    return HullTables(*(np.concatenate(each) for each in zip(*(
        part[:-1] for part in parts), strict=True)), np.concatenate(moved))


def _by_faces(faces: np.ndarray, size: float) -> tuple[np.ndarray, list[np.ndarray]]:
    """Reorder triangles (t,), HULL_FACE: first one of each flat face, then the others, which get
    the plane of their face. Also returns the indices of the triangles of each face.
    """
    planes = np.column_stack([faces['normal'], faces['offset'] / size])
    left, groups = np.arange(len(planes)), []
    while len(left):
        same = np.abs(planes[left] - planes[left[0]]).max(axis=1) < ONE_PLANE
        groups.append(left[same])
        for name in ('normal', 'offset'):
            faces[name][left[same]] = faces[name][left[0]]
        left = left[~same]
    order = np.concatenate([[group[0] for group in groups], *(group[1:] for group in groups)])
    place = np.argsort(order)
    return faces[order], [place[group] for group in groups]


def _boundary(corners: np.ndarray) -> np.ndarray:
    """Corners (c,) of the polygon that triangles (t, 3) make, anticlockwise."""
    edges = {(int(a), int(b)) for triangle in corners
             for a, b in zip(triangle, np.roll(triangle, -1), strict=True)}
    after = {a: b for a, b in edges if (b, a) not in edges}
    found = [min(after)]
    while (onward := after[found[-1]]) != found[0]:
        found.append(onward)
    return np.array(found)


def _edges(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """HULL_EDGE (e,) of those edges that have different faces on both sides."""
    # From each corner to the next; a row of the triangle on one side, and of that on the other.
    begin, end = faces['corners'].ravel(), np.roll(faces['corners'], -1, axis=1).ravel()
    order, reverse = np.lexsort((end, begin)), np.lexsort((begin, end))
    other = np.empty_like(order)
    other[order] = reverse
    face = np.arange(len(begin)) // 3
    normals = faces['normal'][face]
    bends = (begin < end) & (normals != normals[other]).any(axis=1)
    edges = np.zeros(np.count_nonzero(bends), HULL_EDGE)
    edges['corners'] = np.stack([begin, end], axis=1)[bends]
    for side, (normal, sign) in enumerate(((normals, 1.0), (normals[other], -1.0))):
        inward = sign * np.cross(normal, vertices[end] - vertices[begin])[bends]
        edges['inward'][:, side] = inward / np.linalg.norm(inward, axis=1)[:, None]
    return edges
