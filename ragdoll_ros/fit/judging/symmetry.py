"""Left and right: which bodies are a pair, and whether they are alike.

The plane between them faces the doll's left (y) and goes through the body in the middle.
"""
from __future__ import annotations

import math

import numpy as np

from ...model.ragdoll import Joint, Limits, Ragdoll, joint_axes
from ..roles.names import side_of
from .finding import Finding

NEAR, NAMED = 0.03, 0.15
"""How near a body's mirror image is to its partner, of the doll's size; where names tell that one
is left and one right, a step of a walk may lie between."""

LARGER, MUCH_LARGER = 1.6, 4.0
"""Volumes or masses of a pair are doubtful, or wrong, by this factor; bind poses and skins of
real characters are alike to some percent."""

TURNED, FAR_TURNED = math.radians(25), math.radians(60)
"""Limits of a pair are doubtful, or wrong, if they are so far from mirrored; a step of a walk as
bind pose moves them."""


def find_asymmetries(doll: Ragdoll, size: float) -> list[Finding]:
    """What a left body and its right one do not share: size, mass, parent, joint and limits."""
    joints = {joint.child: joint for joint in doll.joints}
    others = dict(pairs(doll, size))
    both = {**others, **{right: left for left, right in others.items()}}
    found = []
    for left, right in others.items():
        a, b = doll.bone(left), doll.bone(right)
        for what, x, y in (('volume', a.shape.volume, b.shape.volume), ('mass', a.mass, b.mass)):
            factor = max(x / y, y / x)
            if factor > LARGER:
                found.append(Finding(f'{left} has {x / y:.2g} times the {what} of {right}',
                                     factor > MUCH_LARGER))
        if left in joints and right in joints:
            found += _compared(joints[left], joints[right], both)
        else:
            root = left if right in joints else right
            found.append(Finding(f'{root} is the root, and {both[root]} is its other side: a root '
                                 'is in the middle', True))
    return found


def pairs(doll: Ragdoll, size: float) -> list[tuple[str, str]]:
    """Names of the left and the right body of each pair: nearest to each other's mirror image."""
    names, sides = [bone.name for bone in doll.bones], [side_of(bone.name) for bone in doll.bones]
    places = np.array([bone.position for bone in doll.bones])
    # The middle body's: neither a limb as root nor a heavy arm moves it.
    images = places * (1, -1, 1) + (0, 2 * np.median(places[:, 1]), 0)
    distances = np.linalg.norm(images[:, None] - places, axis=2)
    nearest = distances.argmin(axis=1)
    found = []
    for index, other in enumerate(nearest):
        near = NAMED if sides[index] * sides[other] < 0 else NEAR
        left = sides[index] or np.sign(places[index, 1] - places[other, 1])
        if (nearest[other] == index != other and left > 0
                and distances[index, other] < near * size):
            found.append((names[index], names[other]))
    return found


def _compared(left: Joint, right: Joint, both: dict[str, str]) -> list[Finding]:
    child, other = left.child, right.child
    if right.parent != both.get(left.parent, left.parent):
        return [Finding(f'{child} hangs from {left.parent}, and {other} from {right.parent}', True)]
    if left.kind != right.kind:
        return [Finding(f'{child} has a {left.kind} joint, and {other} a {right.kind} one', True)]
    off = max(map(_off, joint_axes(left), joint_axes(right), left.angle_limits,
                  right.angle_limits), default=0.0)
    if off > TURNED:
        return [Finding(f'the ranges of {child} and {other} differ by {math.degrees(off):.0f} '
                        'degrees', off > FAR_TURNED)]
    return []


def _off(axis: np.ndarray, other: np.ndarray, limits: Limits | None,
         others: Limits | None) -> float:
    """How far the limits about the other side's axis are from this one's mirror image, rad."""
    if limits is None or others is None:
        return 0.0 if limits is others else math.pi
    # The mirror image of a turn is one about the mirrored axis, the other way round.
    if np.dot(axis * (-1, 1, -1), other) < 0:
        limits = (-limits[1], -limits[0])
    return float(np.abs(np.subtract(limits, others)).max())
