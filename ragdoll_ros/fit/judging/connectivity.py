"""Connectivity of a doll: joints at both of their bodies, a root in the trunk."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...model.ragdoll import Ragdoll
from ..bodies.overlap import penetration_depth
from .finding import Finding

DOUBTFUL_GAP, WRONG_GAP = 0.06, 0.12
"""Distance of an anchor from its body, as a fraction of the doll's size: doubtful, wrong."""

MAX_BRANCH_SHARE = 0.85
"""Largest fraction of the mass on one branch of the root of a branching doll."""

LIMB_ROLES = {'upper_arm', 'forearm', 'hand', 'finger', 'thigh', 'shin', 'foot', 'toe', 'head',
              'soft', 'clavicle'}
"""Roles of bodies that do not belong to the trunk."""


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
    if role in LIMB_ROLES and len(doll.bones) > 1:
        return [Finding(f'the root is {root}, a bone of the limbs', True)]
    below = {bone.name: bone.mass for bone in doll.bones}
    degrees = dict.fromkeys(below, 0)
    for joint in reversed(doll.joints_from_root()):
        below[joint.parent] += below[joint.child]
        degrees[joint.parent] += 1
        degrees[joint.child] += 1
    most = max((below[joint.child] for joint in doll.joints if joint.parent == root), default=0.0)
    if max(degrees.values()) > 2 and most > MAX_BRANCH_SHARE * doll.mass:
        return [Finding(f'the root {root} is at the end of the tree: one joint carries '
                        f'{100 * most / doll.mass:.0f} % of the mass', degrees[root] == 1)]
    return []
