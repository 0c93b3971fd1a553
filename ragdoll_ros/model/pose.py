"""Rigid transforms: the pose of a frame in its parent frame, as of a bone in the doll's frame."""
from __future__ import annotations

from typing import NamedTuple

import numpy as np

from . import rotation


class Pose(NamedTuple):
    """``position`` (..., 3) m of the frame's origin, ``orientation`` (..., 4) x, y, z, w."""

    position: np.ndarray = np.zeros(3)
    orientation: np.ndarray = np.array(rotation.IDENTITY)

    def at(self, index: np.ndarray) -> Pose:
        """The poses (..., k) of these indices (k,) among poses (..., n)."""
        return Pose(self.position[..., index, :], self.orientation[..., index, :])

    def apply(self, points: np.ndarray) -> np.ndarray:
        """Transform points (..., 3) m from the frame to its parent."""
        return self.position + rotation.rotate(self.orientation, points)

    def apply_inverse(self, points: np.ndarray) -> np.ndarray:
        """Transform points (..., 3) m from the parent to the frame."""
        back = rotation.inverse(self.orientation)
        return rotation.rotate(back, np.subtract(points, self.position))

    def compose(self, inner: Pose) -> Pose:
        """Pose in the parent of a frame whose pose in this frame is ``inner``."""
        return Pose(self.apply(inner.position),
                    rotation.multiply(self.orientation, inner.orientation))

    def relative(self, pose: Pose) -> Pose:
        """Pose in this frame of a frame whose pose in the parent is ``pose``."""
        back = rotation.inverse(self.orientation)
        return Pose(self.apply_inverse(pose.position), rotation.multiply(back, pose.orientation))
