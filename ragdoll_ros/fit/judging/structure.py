"""Structure of a doll: joints at both of their bodies, a root in the trunk, symmetric sides.

The mirror plane is normal to y, at the median of the bodies.
"""
import math
from collections.abc import Sequence

import numpy as np

from ...files.bone_names.names import side_of
from ...model.ragdoll import Joint, Limits, Ragdoll, joint_axes
from ..bodies.overlap import penetration_depth
from .finding import Finding

MIRROR_DISTANCE, NAMED_MIRROR_DISTANCE = 0.03, 0.15
"""Distance of a body's mirror image from its counterpart, as a fraction of the doll's size; larger
where names state left and right, for bind poses in the middle of a step."""

DOUBTFUL_RATIO, WRONG_RATIO = 1.6, 4.0
"""Ratio of volumes or masses of a pair that is doubtful, wrong; real characters are symmetric to a
few percent."""

DOUBTFUL_ANGLE, WRONG_ANGLE = math.radians(25), math.radians(60)
"""Difference of limits from their mirror image that is doubtful, wrong; a bind pose in the middle
of a step shifts them."""

DOUBTFUL_GAP, WRONG_GAP = 0.06, 0.12
"""Distance of an anchor from its body, as a fraction of the doll's size: doubtful, wrong."""

MAX_BRANCH_SHARE = 0.85
"""Largest fraction of the mass on one branch of the root of a branching doll."""

LIMB_ROLES = {'upper_arm', 'forearm', 'hand', 'finger', 'thigh', 'shin', 'foot', 'toe', 'head',
              'soft', 'clavicle'}
"""Roles of bodies that do not belong to the trunk."""

TRUNK_ROLES = {'hips', 'spine'}


def find_detached_joints(doll: Ragdoll, size: float) -> list[Finding]:
    """Joints whose anchor is too far from one of their bodies; ``size`` is the doll's, m."""
    found = []
    for joint in doll.joints:
        for name in (joint.parent, joint.child):
            gap = -float(penetration_depth(doll.bone(name), np.array([joint.anchor]))[0])
            if gap > DOUBTFUL_GAP * size:
                found.append(Finding(
                    f'the joint of {joint.child} to {joint.parent} is {gap:.2g} m outside {name}, '
                    f'{100 * gap / size:.0f} % of the size', gap > WRONG_GAP * size))
    return found


def find_wrong_root(doll: Ragdoll, roles: Sequence[str | None]) -> list[Finding]:
    """A root outside the trunk: in a limb, or at the end of a tree that branches elsewhere."""
    root = doll.root.name
    role = dict(zip((bone.name for bone in doll.bones), roles, strict=True))[root]
    # A monster may be all head.
    is_trunk = role == 'head' and not TRUNK_ROLES & set(roles)
    if role in LIMB_ROLES and not is_trunk and len(doll.bones) > 1:
        return [Finding(f'the root is {root}, a bone of the limbs', True)]
    # Without the head, which may be most of a figure and is no reason for a root beside it.
    below = {bone.name: 0.0 if its == 'head' and bone.name != root else bone.mass
             for bone, its in zip(doll.bones, roles, strict=True)}
    degrees, whole = dict.fromkeys(below, 0), sum(below.values())
    for joint in reversed(doll.joints_from_root()):
        below[joint.parent] += below[joint.child]
        degrees[joint.parent] += 1
        degrees[joint.child] += 1
    most = max((below[joint.child] for joint in doll.joints if joint.parent == root), default=0.0)
    if max(degrees.values()) > 2 and most > MAX_BRANCH_SHARE * whole:
        return [Finding(f'the root {root} is at the end of the tree: one joint carries '
                        f'{100 * most / whole:.0f} % of the mass', degrees[root] == 1)]
    return []


def find_asymmetries(doll: Ragdoll, size: float) -> list[Finding]:
    """Differences of left and right: volume, mass, parent, joint kind, limits; ``size`` in m."""
    joints = {joint.child: joint for joint in doll.joints}
    others = dict(mirrored_pairs(doll, size))
    counterparts = {**others, **{right: left for left, right in others.items()}}
    found = []
    for left, right in others.items():
        a, b = doll.bone(left), doll.bone(right)
        for what, x, y in (('volume', a.shape.volume, b.shape.volume), ('mass', a.mass, b.mass)):
            factor = max(x / y, y / x)
            if factor > DOUBTFUL_RATIO:
                found.append(Finding(f'{left} has {x / y:.2g} times the {what} of {right}',
                                     factor > WRONG_RATIO))
        if left in joints and right in joints:
            found += _compare_joints(joints[left], joints[right], counterparts)
        else:
            root = left if right in joints else right
            found.append(Finding(f'the root {root} has a counterpart on the other side, '
                                 f'{counterparts[root]}: a root is in the middle', True))
    return found


def mirrored_pairs(doll: Ragdoll, size: float) -> list[tuple[str, str]]:
    """Names (left, right) of bodies that are nearest to each other's mirror image."""
    names, sides = [bone.name for bone in doll.bones], [side_of(bone.name) for bone in doll.bones]
    places = np.array([bone.position for bone in doll.bones])
    # The median: neither a root in a limb nor a heavy arm shifts it.
    images = places * (1, -1, 1) + (0, 2 * np.median(places[:, 1]), 0)
    distances = np.linalg.norm(images[:, None] - places, axis=2)
    nearest = distances.argmin(axis=1)
    found = []
    for index, other in enumerate(nearest):
        near = NAMED_MIRROR_DISTANCE if sides[index] * sides[other] < 0 else MIRROR_DISTANCE
        left = sides[index] or np.sign(places[index, 1] - places[other, 1])
        if (nearest[other] == index != other and left > 0
                and distances[index, other] < near * size):
            found.append((names[index], names[other]))
    return found


def _compare_joints(left: Joint, right: Joint, counterparts: dict[str, str]) -> list[Finding]:
    child, other = left.child, right.child
    if right.parent != counterparts.get(left.parent, left.parent):
        return [Finding(f'{child} has the parent {left.parent}, and {other} {right.parent}', True)]
    if left.kind != right.kind:
        return [Finding(f'{child} has a {left.kind} joint, and {other} a {right.kind} one', True)]
    difference = max(map(_limit_difference, joint_axes(left), joint_axes(right),
                         left.angle_limits, right.angle_limits), default=0.0)
    if difference > DOUBTFUL_ANGLE:
        return [Finding(f'the ranges of {child} and {other} differ by '
                        f'{math.degrees(difference):.0f} degrees', difference > WRONG_ANGLE)]
    return []


def _limit_difference(axis: np.ndarray, other: np.ndarray, limits: Limits | None,
                      others: Limits | None) -> float:
    """Largest difference, rad, between ``others`` about ``other`` and the mirror image of
    ``limits`` about ``axis``; pi where only one of them is unlimited.
    """
    if limits is None or others is None:
        return 0.0 if limits is others else math.pi
    # Mirroring reverses the sense of a rotation.
    if np.dot(axis * (-1, 1, -1), other) < 0:
        limits = (-limits[1], -limits[0])
    return float(np.abs(np.subtract(limits, others)).max())
