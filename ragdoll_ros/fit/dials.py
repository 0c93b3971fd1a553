"""Joints and their ranges as lines, for the picture of a doll in its bind pose."""
from __future__ import annotations

import numpy as np

from ..model import rotation
from ..model.ragdoll import Joint, Ragdoll, joint_axes

PIECES = 16
"""Lines that make up an arc."""

SIZES = (0.02, 0.09)
"""Shortest and longest radius, of the doll's size; else half the child's length."""


def dials(doll: Ragdoll) -> list[tuple[int, np.ndarray]]:
    """Number of the angle, 0 to 2, and points (p, 3) m of the sector that it may go through.

    From the anchor to where the child's middle may get by that angle alone, and back.
    """
    return [(number, np.concatenate([[joint.anchor], joint.anchor + arc, [joint.anchor]]))
            for joint in doll.joints
            for number, (axis, pair) in enumerate(zip(
                joint_axes(joint), joint.angle_limits, strict=True))
            if pair is not None for arc in [_arc(axis, _needle(doll, joint, axis), pair)]]


def _needle(doll: Ragdoll, joint: Joint, axis: np.ndarray) -> np.ndarray:
    """From the anchor toward the child, across the axis (3,) m."""
    child = doll.bone(joint.child)
    toward = np.subtract(child.position, joint.anchor)
    toward = toward - axis * (axis @ toward)
    if np.linalg.norm(toward) < 0.3 * np.linalg.norm(np.subtract(child.position, joint.anchor)):
        # A twist shows by what is across it.
        toward = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    return rotation.normalized(toward) * np.clip(
        max(child.shape.half_extents), *(doll.extent * share for share in SIZES))


def _arc(axis: np.ndarray, needle: np.ndarray, pair: tuple[float, float]) -> np.ndarray:
    angles = np.linspace(*pair, PIECES + 1)
    return rotation.rotate(rotation.from_rotation_vector(angles[:, None] * axis), needle)
