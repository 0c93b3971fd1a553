"""Geoms of the triangles of a static surface, and of a hull that moves."""
import numpy as np

from ....model import rotation
from ....model.mesh import Hull, Triangles
from ....model.pose import Pose
from ...kernels.collision.shapes import HULL, TRIANGLE
from ...kernels.dynamics.body import WORLD
from ...kernels.system import GEOM

ONE_PLANE = 1e-9
"""Difference of normals, and of distances over the hull's size, up to which faces are one."""


def triangle_geoms(triangles: Triangles, pose: Pose) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """GEOM (t,) of triangles at a pose in the world, see kernels/collision/triangles/triangle.py,
    and the lower and the upper corners (t, 3) m of their bounding boxes.
    """
    corners = pose.apply(triangles.corners)
    normal = rotation.rotate(pose.orientation, triangles.normals)
    center = corners.mean(axis=1)
    first, second, _ = np.moveaxis(corners, 1, 0)
    length = np.linalg.norm(second - first, axis=1)
    edge = (second - first) / length[:, None]
    axes = np.stack([edge, np.cross(normal, edge), normal], axis=2)
    arms = np.einsum('tji,tkj->tki', axes, corners - center[:, None])
    geoms = np.zeros(len(corners), GEOM)
    geoms['body'], geoms['kind'] = WORLD, TRIANGLE
    first_arm, _, third_arm = np.moveaxis(arms, 1, 0)
    (x, _, _), (_, y, _) = first_arm.T, third_arm.T
    geoms['size'] = np.stack([x, length, y], axis=1)
    geoms['position'], geoms['edges'] = center, triangles.edges
    geoms['orientation'] = rotation.from_matrix(axes)
    geoms['bounding_radius'] = np.linalg.norm(arms, axis=2).max(axis=1)
    return geoms, corners.min(axis=1), corners.max(axis=1)


def geom_count(shape: object) -> int:
    """Geoms of a shape of a bone: one, of a hull its triangles as well."""
    return 1 + len(shape.triangles.corners) if isinstance(shape, Hull) else 1


def is_of_hull(geoms: np.ndarray) -> np.ndarray:
    """Which GEOM (g,) of bones are hulls and their triangles."""
    return (geoms['kind'] == HULL) | (geoms['kind'] == TRIANGLE)


def hull_geoms(hull: Hull, pose: Pose) -> tuple[np.ndarray, np.ndarray]:
    """GEOM (1 + t,) of a hull and its triangles, see kernels/system.py, at a pose in the frame of
    its body, and its vertices (v, 3) m in the frame of the first. Their body is left open.
    """
    own = np.unique(hull.triangles.corners.reshape(-1, 3), axis=0)
    own = own[np.lexsort(own.T)]
    center = (own.min(axis=0) + own.max(axis=0)) / 2
    order, face = _by_faces(hull.triangles)
    triangles, _, _ = triangle_geoms(Triangles(*(part[order] for part in vars(
        hull.triangles).values())), pose)
    triangles['face'] = face
    geoms = np.zeros(1 + len(triangles), GEOM)
    geoms[1:] = triangles
    whole = geoms[:1]
    whole['kind'], whole['triangles'] = HULL, len(triangles)
    whole['position'], whole['orientation'] = pose.apply(center), pose.orientation
    whole['bounding_radius'] = np.linalg.norm(own - center, axis=1).max()
    geoms['reach'] = np.linalg.norm(geoms['position'], axis=1) + geoms['bounding_radius']
    whole['reach'] = np.linalg.norm(pose.apply(own), axis=1).max()
    geoms['reach'] = np.minimum(geoms['reach'], whole['reach'])
    return geoms, own - center


def _by_faces(triangles: Triangles) -> tuple[np.ndarray, np.ndarray]:
    """An order (t,) of triangles in which those of a flat face follow each other, and how many
    each (t,) then is after the first of its face.
    """
    centers = triangles.corners.mean(axis=1)
    planes = np.column_stack([triangles.normals, np.einsum(
        'ti,ti->t', triangles.normals, centers) / np.ptp(triangles.corners)])
    left, order, face = np.arange(len(planes)), [], []
    while len(left):
        same = np.abs(planes[left] - planes[left[0]]).max(axis=1) < ONE_PLANE
        order.append(left[same])
        face.append(np.arange(same.sum()))
        left = left[~same]
    return np.concatenate(order), np.concatenate(face)
