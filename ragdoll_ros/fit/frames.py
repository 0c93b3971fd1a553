"""Between the doll's frame and a body's own: its centre of mass and its shape's axes; bind pose."""
from __future__ import annotations

import numpy as np

from ..model import rotation
from ..model.ragdoll import Bone


def from_body(bone: Bone, points: np.ndarray) -> np.ndarray:
    """Points (..., 3) m of a body's own frame, in the doll's."""
    return rotation.rotate(np.array(bone.orientation), points) + bone.position


def to_body(bone: Bone, points: np.ndarray) -> np.ndarray:
    """Points (..., 3) m of the doll's frame, in a body's own."""
    return rotation.rotate(rotation.inverse(np.array(bone.orientation)), points - bone.position)


def pose_in_body(bone: Bone, position: np.ndarray,
                 orientation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pose, (3,) m and (4,), of the doll's frame, in a body's own."""
    back = rotation.inverse(np.array(bone.orientation))
    return to_body(bone, position), rotation.multiply(back, orientation)
