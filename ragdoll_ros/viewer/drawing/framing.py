"""Where a camera sees all of a scene: from the front, a little aside and from above.

The camera looks at a point c along the unit vector f, with r to its right and u up; it stands at
c - d f. A ball of radius s at c + q lies within the plane of an edge of the picture, at the half
angle h from f, if (d + q f) sin h - |q r| cos h >= s, and likewise for u. The least d that all
balls allow is the largest of (s + |q r| cos h) / sin h - q f.
"""
from __future__ import annotations

import math

import numpy as np

from ...model.scene import Scene
from ...model.state import State

FROM = np.array((3.2, -0.9, 0.6))
"""Direction in which the camera stands from what it looks at, any length: in front of the doll, as
the arrow keys have it."""

MARGIN = 1.3
"""How much further away it stands than it must."""

NEAREST = 2.5
"""m that it stands away at least: closer, a small doll's fall would leave the picture at once."""


def bounds(scene: Scene, state: State) -> tuple[np.ndarray, np.ndarray]:
    """Centres (m, 3) m, world frame, and radii (m,) m of balls that hold each bone.

    Above a ground also where each would touch it, straight below: what hangs there will fall.
    """
    radii = np.array([np.linalg.norm(bone.shape.half_extents) for bone in scene.bones])
    if scene.ground is None:
        return state.positions, radii
    normal = np.array(scene.ground.normal)
    heights = state.positions @ normal - scene.ground.offset - radii
    fallen = state.positions - np.maximum(heights, 0.0)[:, None] * normal
    return np.concatenate((state.positions, fallen)), np.concatenate((radii, radii))


def middle(centres: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Middle (3,) m of the box around all balls."""
    lower, upper = (centres - radii[:, None]).min(axis=0), (centres + radii[:, None]).max(axis=0)
    return (lower + upper) / 2


def place(centres: np.ndarray, radii: np.ndarray, look_at: np.ndarray, fov: float,
          aspect: float) -> np.ndarray:
    """Place (3,) m of a camera that looks at ``look_at`` (3,) m and sees all balls.

    ``fov``: from top to bottom, rad; ``aspect``: width of the picture to its height.
    """
    forward = -FROM / np.linalg.norm(FROM)
    right = np.cross(forward, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    offsets = centres - look_at
    distance = NEAREST
    for axis, half in _edges(forward, right, fov, aspect):
        least = (radii + abs(offsets @ axis) * math.cos(half)) / math.sin(half) - offsets @ forward
        distance = max(distance, MARGIN * float(least.max()))
    return look_at - distance * forward


def sees(position: np.ndarray, look_at: np.ndarray, fov: float, aspect: float,
         centres: np.ndarray, radii: np.ndarray) -> bool:
    """Whether a camera at ``position`` (3,) m that looks at ``look_at`` (3,) m sees all balls."""
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
    """Directions up and right of a picture, each with the half angle to its edge, rad."""
    return ((np.cross(right, forward), fov / 2),
            (right, math.atan(math.tan(fov / 2) * aspect)))
