"""A scene's dolls as one table for compiled code: a record for each bone, parents first."""
from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .. import rotation
from ..ragdoll import Joint, Ragdoll
from ..scene import Scene
from ..urdf import joint_frame

RECORD = np.dtype([
    ('bone', np.int64), ('parent', np.int64), ('free', np.int64), ('freedoms', np.int64),
    ('q', np.int64), ('v', np.int64), ('mass', float), ('inertia', float, 3), ('bind', float, 4),
    ('before', float, 3), ('after', float, 3), ('axes', float, (3, 3)), ('damping', float)],
    align=True)
"""``bone``: its place in the scene. ``parent``: the record of its parent, -1 for a root.
``free``: 1 where a quaternion in q stands for its turn: roots and ball joints without limits.
``freedoms``: of its joint, none for a root's. ``q``, ``v``: where its coordinates begin.
``bind``: its principal axes in the doll's. ``before``, ``after``: from the parent's centre of mass
to the anchor, and from there to its own, m, and ``axes``, rows, all along the doll's axes as in
the bind pose."""


def table(scene: Scene) -> np.ndarray:
    """Records of all bones of a scene, coordinates in the order of Layout."""
    records, names, q, v = [], scene.bone_names, 0, 0
    for placement in scene.dolls:
        doll = placement.doll
        at = {}
        for joint in (None, *depth_first(doll)):
            bone = doll.root if joint is None else doll.bone(joint.child)
            record = np.zeros((), RECORD)
            at[bone.name] = len(records)
            record['bone'] = names.index(scene.qualified(placement, bone.name))
            record['mass'], record['inertia'] = bone.mass, bone.inertia
            record['bind'], record['q'], record['v'] = bone.orientation, q, v
            if joint is None:
                record['parent'], record['free'] = -1, 1
                q, v = q + 7, v + 6
            else:
                parent = doll.bone(joint.parent)
                free = joint.kind == 'ball' and not any(joint.limits)
                record['parent'], record['free'] = at[joint.parent], free
                record['freedoms'], record['damping'] = joint.freedoms, joint.damping
                record['before'] = np.subtract(joint.anchor, parent.position)
                record['after'] = np.subtract(bone.position, joint.anchor)
                axes = joint.axes
                if joint.kind == 'ball':
                    axes = rotation.matrix(joint_frame(joint)).T
                for row, axis in enumerate(axes):
                    record['axes'][row] = axis
                q, v = q + (4 if free else joint.freedoms), v + joint.freedoms
            records.append(record)
    return np.array(records, RECORD)


def depth_first(doll: Ragdoll) -> Iterator[Joint]:
    """All joints, each one's whole branch before the next, as engines count them."""
    def branch(name: str) -> Iterator[Joint]:
        for joint in doll.joints:
            if joint.parent == name:
                yield joint
                yield from branch(joint.child)
    return branch(doll.root.name)
