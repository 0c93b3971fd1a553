"""How a doll hangs together: joints at both their bodies, a trunk as its root."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...model.ragdoll import Ragdoll
from ..bodies.overlap import depth_in
from .finding import Finding

GAP, WIDE_GAP = 0.06, 0.12
"""How far from a body its joint may be, of the doll's size: what is more is doubtful, or wrong."""

BRANCH = 0.85
"""Share of the mass that one branch of the root has at the most, where the doll has branches."""

OUTER = {'upper_arm', 'forearm', 'hand', 'finger', 'thigh', 'shin', 'foot', 'toe', 'head', 'soft',
         'clavicle'}
"""Roles of bodies that are no trunk."""


def find_gaps(doll: Ragdoll, size: float) -> list[Finding]:
    """Joints that are not in or at both bodies."""
    found = []
    for joint in doll.joints:
        for name in (joint.parent, joint.child):
            gap = -float(depth_in(doll.bone(name), np.array([joint.anchor]))[0])
            if gap > GAP * size:
                found.append(Finding(
                    f'the joint of {joint.child} to {joint.parent} is {gap:.2g} m outside {name}, '
                    f'{100 * gap / size:.0f} % of the size', gap > WIDE_GAP * size))
    return found


def find_wrong_root(doll: Ragdoll, roles: Sequence[str | None]) -> list[Finding]:
    """A root that is no trunk: a limb's, or the end of a tree that branches elsewhere."""
    root = doll.root.name
    role = dict(zip((bone.name for bone in doll.bones), roles, strict=True))[root]
    if role in OUTER and len(doll.bones) > 1:
        return [Finding(f'the root is {root}, a bone of the limbs', True)]
    below = {bone.name: bone.mass for bone in doll.bones}
    degrees = dict.fromkeys(below, 0)
    for joint in reversed(doll.joints_from_root()):
        below[joint.parent] += below[joint.child]
        degrees[joint.parent] += 1
        degrees[joint.child] += 1
    most = max((below[joint.child] for joint in doll.joints if joint.parent == root), default=0.0)
    if max(degrees.values()) > 2 and most > BRANCH * doll.mass:
        return [Finding(f'the root {root} is at the end: {100 * most / doll.mass:.0f} % of the '
                        'mass hang from it on one joint', degrees[root] == 1)]
    return []
