"""Geoms of the triangles of a static surface."""
import numpy as np

from ....model import rotation
from ....model.mesh import Triangles
from ....model.pose import Pose
from ...kernels.collision.shapes import TRIANGLE
from ...kernels.dynamics.body import WORLD
from ...kernels.system import GEOM


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
