"""Where a person's limbs point in the anatomical pose, carried into the bind pose by their parents.

Upright, arms and legs down, feet flat. Shoulders and hips are seen from the trunk, which stands
upright in every bind pose; a wrist, an ankle or a head from the bone before it, whatever way that
one is bound.
"""
from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..reading.character import Character
from ..skeleton.groups import Group

FORWARD, LEFT, UP = np.eye(3)

SLOPE = math.atan(0.039 / 0.114)
"""How far the toes' end is below a level line through the ankle, as an angle: of a person's
height the ankle is .039 above the sole, the foot .152 long, a quarter of it behind the ankle
(Drillis and Contini, Body Segment Parameters, 1966)."""

TOES = 0.1
"""Share of a foot's skin, that farthest from the ankle, whose middle is the toes' end."""

FLAT = 0.8
"""A hand is flat, so that its skin tells where the palm is, where it is so much thinner than
broad; of real hands .6."""

HEADS = ('neck', 'head')


@dataclass(frozen=True)
class Neutral:
    """Unit directions (3,), doll's frame, bind pose; ``axis`` is across ``straight``."""

    straight: np.ndarray
    """Where the limb would point if its parent were as it is bound and this joint as one stands."""
    axis: np.ndarray
    """About which its first angle is."""
    along: np.ndarray
    """Where it points."""


def neutral(character: Character, groups: list[Group], index: int, side: int,
            above: np.ndarray | None, along: np.ndarray) -> Neutral | None:
    """Of the joint to a group's parent; None where the skeleton or the bind pose tells none.

    ``above`` (3,) is the direction of the bone before, None below the root; ``along`` (3,) that of
    the group's own; ``side`` is 1 on the left, -1 on the right.
    """
    group = groups[index]
    if group.role == 'upper_arm':
        return Neutral(-UP, FORWARD, along)
    if group.role == 'thigh':
        return Neutral(-UP, LEFT, along)
    if group.role in HEADS:
        straight = above if groups[group.parent].role in HEADS and above is not None else UP
        return _across(straight, LEFT, along)
    if above is None:
        return None
    if group.role == 'hand':
        return _across(above, np.cross(above, _palm(character, group, side, above)), along)
    toes = _toes(character, groups, index)
    shin = _across(above, LEFT, toes)
    if shin is None:
        return None
    ahead = np.cross(above, shin.axis)
    return Neutral(math.cos(SLOPE) * ahead + math.sin(SLOPE) * above, shin.axis, toes)


def _across(straight: np.ndarray, axis: np.ndarray, along: np.ndarray) -> Neutral | None:
    """With what of ``axis`` is across ``straight``; None where that is little."""
    axis = axis - (axis @ straight) * straight
    length = float(np.linalg.norm(axis))
    return Neutral(straight, axis / length, along) if length > 0.3 else None


def _palm(character: Character, group: Group, side: int, above: np.ndarray) -> np.ndarray:
    """Unit direction (3,) that the palm faces: the hand's thin one, else to where arms hang.

    Arms that hang have their palms to the thighs, and forearms turn them forwards as far as
    backwards, but for a little.
    """
    inward = side * np.cross(above, FORWARD)
    if np.linalg.norm(inward) < 0.3:
        inward = side * np.cross(above, UP)
    inward = inward / np.linalg.norm(inward)
    points = character.vertices[group.vertices]
    if len(points) < 4:
        return inward
    extents, axes = np.linalg.eigh(np.cov(points.T))
    if extents[0] > FLAT ** 2 * extents[1]:
        return inward
    return axes[:, 0] if axes[:, 0] @ (2 * inward + FORWARD) > 0 else -axes[:, 0]


def _toes(character: Character, groups: list[Group], index: int) -> np.ndarray:
    """Unit direction (3,) from the ankle to the toes' end."""
    ankle = groups[index].anchor
    steps = np.concatenate([character.vertices[group.vertices] - ankle for group in groups
                            if group is groups[index] or group.parent == index])
    far = np.linalg.norm(steps, axis=1)
    end = steps[far >= np.quantile(far, 1 - TOES)].mean(axis=0) if len(steps) else -UP
    return end / max(float(np.linalg.norm(end)), 1e-9)
