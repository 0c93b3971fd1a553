"""Directions of a person's limbs in the anatomical pose, transferred to the bind pose.

In the anatomical pose arms and legs hang down and the feet are level. Shoulders, hips and the
lowest joint of neck and head refer to the trunk, which is upright in every bind pose; a wrist, an
ankle and further joints of neck and head refer to the bone before them.
"""
import math
from dataclasses import dataclass

import numpy as np

from ..reading.character import Character
from ..skeleton.groups import BodyGroup

FORWARD, LEFT, UP = np.eye(3)

FOOT_SLOPE = math.atan(0.039 / 0.114)
"""Angle below horizontal of the line from the ankle to the end of the toes. As fractions of body
height, the ankle is .039 above the sole; the foot is .152 long, a quarter of it behind the ankle
(Drillis and Contini, Body Segment Parameters, 1966)."""

TOE_SHARE = 0.1
"""Fraction of a foot's vertices, farthest from the ankle, whose mean is the end of the toes."""

MAX_HAND_FLATNESS = 0.8
"""Largest ratio of thickness to breadth at which a hand's shape shows its palm; real hands have
0.6."""

HEAD_ROLES = ('neck', 'head')


@dataclass(frozen=True)
class NeutralDirections:
    """Unit directions (3,), doll's frame, bind pose; ``axis`` is perpendicular to ``straight``."""

    straight: np.ndarray
    """Direction of the limb with this joint in the anatomical pose and its parent as bound."""
    axis: np.ndarray
    """Axis of the first angle."""
    along: np.ndarray
    """Direction of the limb in the bind pose."""


def find_neutral(character: Character, groups: list[BodyGroup], index: int, side: int,
                 above: np.ndarray | None, along: np.ndarray) -> NeutralDirections | None:
    """Neutral directions of the joint to a group's parent; None where they are undefined.

    ``above`` (3,) is the direction of the parent's bone, as from parent_direction; ``along`` (3,)
    that of the group's own; ``side`` is 1 left, -1 right.
    """
    group = groups[index]
    if group.role == 'upper_arm':
        return NeutralDirections(-UP, FORWARD, along)
    if group.role == 'thigh':
        return NeutralDirections(-UP, LEFT, along)
    if group.role in HEAD_ROLES:
        straight = above if groups[group.parent].role in HEAD_ROLES and above is not None else UP
        return _perpendicular_axis(straight, LEFT, along)
    if above is None:
        return None
    if group.role == 'hand':
        palm = _palm(character, group, side, above)
        return _perpendicular_axis(above, np.cross(above, palm), along)
    toes = _toes(character, groups, index)
    shin = _perpendicular_axis(above, LEFT, toes)
    if shin is None:
        return None
    ahead = np.cross(above, shin.axis)
    straight = math.cos(FOOT_SLOPE) * ahead + math.sin(FOOT_SLOPE) * above
    return NeutralDirections(straight, shin.axis, toes)


def _perpendicular_axis(straight: np.ndarray, axis: np.ndarray,
                        along: np.ndarray) -> NeutralDirections | None:
    """Neutral directions whose axis is the unit component of ``axis`` perpendicular to
    ``straight``; None if that component is small.
    """
    axis = axis - (axis @ straight) * straight
    length = float(np.linalg.norm(axis))
    return NeutralDirections(straight, axis / length, along) if length > 0.3 else None


def _palm(character: Character, group: BodyGroup, side: int, above: np.ndarray) -> np.ndarray:
    """Unit direction (3,) that the palm faces: the hand's thin axis, else towards the thigh.

    The palms of hanging arms face the thighs, and a forearm rotates about as far either way.
    """
    inward = side * np.cross(above, FORWARD)
    if np.linalg.norm(inward) < 0.3:
        inward = side * np.cross(above, UP)
    inward = inward / np.linalg.norm(inward)
    points = character.vertices[group.vertices]
    if len(points) < 4:
        return inward
    extents, axes = np.linalg.eigh(np.cov(points.T))
    if extents[0] > MAX_HAND_FLATNESS ** 2 * extents[1]:
        return inward
    return axes[:, 0] if axes[:, 0] @ (2 * inward + FORWARD) > 0 else -axes[:, 0]


def _toes(character: Character, groups: list[BodyGroup], index: int) -> np.ndarray:
    """Unit direction (3,) from the ankle to the end of the toes."""
    ankle = groups[index].anchor
    steps = np.concatenate([character.vertices[group.vertices] - ankle for group in groups
                            if group is groups[index] or group.parent == index])
    far = np.linalg.norm(steps, axis=1)
    end = steps[far >= np.quantile(far, 1 - TOE_SHARE)].mean(axis=0) if len(steps) else -UP
    return end / max(float(np.linalg.norm(end)), 1e-9)
