"""Poses: where a frame stands in another one, as a bone's in the doll's, a doll's in the world."""
from __future__ import annotations

from typing import NamedTuple

import numpy as np

from . import rotation


class Pose(NamedTuple):
    """``position`` (..., 3) m of the frame's origin, ``orientation`` (..., 4) of its axes."""

    position: np.ndarray = np.zeros(3)
    orientation: np.ndarray = np.array(rotation.IDENTITY)

    def apply(self, points: np.ndarray) -> np.ndarray:
        """Points (..., 3) m of the frame, in the other one."""
        return self.position + rotation.rotate(self.orientation, points)

    def apply_inverse(self, points: np.ndarray) -> np.ndarray:
        """Points (..., 3) m of the other one, in the frame."""
        back = rotation.inverse(self.orientation)
        return rotation.rotate(back, np.subtract(points, self.position))

    def compose(self, inner: Pose) -> Pose:
        """Pose in the other one of what stands at ``inner`` in the frame."""
        return Pose(self.apply(inner.position),
                    rotation.multiply(self.orientation, inner.orientation))

    def relative(self, pose: Pose) -> Pose:
        """Pose in the frame of what stands at ``pose`` in the other one."""
        back = rotation.inverse(self.orientation)
        return Pose(self.apply_inverse(pose.position), rotation.multiply(back, pose.orientation))
