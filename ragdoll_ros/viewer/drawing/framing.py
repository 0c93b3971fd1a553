"""Camera positions from which a whole scene is in view, from the front and slightly above.

The camera at c - d f looks at a point c along the unit vector f, with r to its right and u up. A
sphere of radius s at c + q is inside a side plane of the frustum, at the half angle h from f, if
(d + q f) sin h - |q r| cos h >= s, and likewise for u. So the smallest distance d is the maximum
over all spheres of (s + |q r| cos h) / sin h - q f.
"""
from __future__ import annotations

import math

import numpy as np

from ...model.scene import Scene
from ...model.state import State

VIEW_DIRECTION = np.array((3.2, -0.9, 0.75))
"""From the target towards the camera, any length: from the front, as the arrow keys assume."""

MARGIN = 1.15
"""Factor of the smallest distance."""

MIN_DISTANCE = 2.5
"""m: closer, the fall of a small doll would leave the view at once."""


def bounding_spheres(scene: Scene, state: State) -> tuple[np.ndarray, np.ndarray]:
    """Centres (m, 3) m, world frame, and radii (m,) m of spheres around each bone.

    With a ground, also the same spheres moved along its normal until they touch it, where the bones
    will fall.
    """
    radii = np.array([np.linalg.norm(bone.shape.half_extents) for bone in scene.bones])
    if scene.ground is None:
        return state.positions, radii
    normal = np.array(scene.ground.normal)
    heights = state.positions @ normal - scene.ground.offset - radii
    fallen = state.positions - np.maximum(heights, 0.0)[:, None] * normal
    return np.concatenate((state.positions, fallen)), np.concatenate((radii, radii))


def box_center(centres: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Centre (3,) m of the axis-aligned box around all spheres."""
    lower, upper = (centres - radii[:, None]).min(axis=0), (centres + radii[:, None]).max(axis=0)
    return (lower + upper) / 2


def home_position(centres: np.ndarray, radii: np.ndarray, look_at: np.ndarray, fov: float,
                  aspect: float) -> np.ndarray:
    """Position (3,) m of a camera that looks at ``look_at`` (3,) m and sees all spheres.

    ``fov``: vertical, rad; ``aspect``: width to height.
    """
    forward = -VIEW_DIRECTION / np.linalg.norm(VIEW_DIRECTION)
    right = np.cross(forward, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    offsets = centres - look_at
    distance = MIN_DISTANCE
    for axis, half in _edges(forward, right, fov, aspect):
        least = (radii + abs(offsets @ axis) * math.cos(half)) / math.sin(half) - offsets @ forward
        distance = max(distance, MARGIN * float(least.max()))
    return look_at - distance * forward


def sees_all(position: np.ndarray, look_at: np.ndarray, fov: float, aspect: float,
             centres: np.ndarray, radii: np.ndarray) -> bool:
    """Whether a camera at ``position`` (3,) m, looking at ``look_at`` (3,) m, sees all spheres.

    False for a camera that looks straight up or down.
    """
    gaze = look_at - position
    length = np.linalg.norm(gaze)
    right = np.cross(gaze, (0.0, 0.0, 1.0))
    if length == 0.0 or np.linalg.norm(right) < 1e-9 * length:
        return False
    forward, right = gaze / length, right / np.linalg.norm(right)
    offsets = centres - position
    depths = offsets @ forward
    return all(bool((depths * math.sin(half) - abs(offsets @ axis) * math.cos(half) >= radii).all())
               for axis, half in _edges(forward, right, fov, aspect))


def _edges(forward: np.ndarray, right: np.ndarray, fov: float,
           aspect: float) -> tuple[tuple[np.ndarray, float], ...]:
    """Up and right direction of the view, each with the half angle of the frustum, rad."""
    return ((np.cross(right, forward), fov / 2), (right, math.atan(math.tan(fov / 2) * aspect)))
