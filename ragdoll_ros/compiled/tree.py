"""A scene's dolls as one table for compiled code: a record for each bone, parents first."""
from __future__ import annotations

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
    places = {name: place for place, name in enumerate(scene.bone_names)}
    records: list[np.ndarray] = []
    q = v = 0
    for placement in scene.dolls:
        doll, at = placement.doll, {}
        for joint in (None, *doll.joints_depth_first()):
            bone = doll.bone(joint.child) if joint else doll.root
            record = _joined(doll, joint, at) if joint else _root()
            record['bone'] = places[scene.qualified(placement, bone.name)]
            record['mass'], record['inertia'] = bone.mass, bone.inertia
            record['bind'], record['q'], record['v'] = bone.orientation, q, v
            at[bone.name] = len(records)
            records.append(record)
            if joint is None:
                q, v = q + 7, v + 6
            else:
                q, v = q + (4 if record['free'] else joint.freedoms), v + joint.freedoms
    return np.array(records, RECORD)


def _root() -> np.ndarray:
    record = np.zeros((), RECORD)
    record['parent'], record['free'] = -1, 1
    return record


def _joined(doll: Ragdoll, joint: Joint, at: dict[str, int]) -> np.ndarray:
    """What a joint says of its child's record; ``at``: which record is whose."""
    record = np.zeros((), RECORD)
    record['parent'] = at[joint.parent]
    record['free'] = joint.is_free_ball
    record['freedoms'], record['damping'] = joint.freedoms, joint.damping
    record['before'] = np.subtract(joint.anchor, doll.bone(joint.parent).position)
    record['after'] = np.subtract(doll.bone(joint.child).position, joint.anchor)
    axes = rotation.matrix(joint_frame(joint)).T if joint.kind == 'ball' else joint.axes
    for row, axis in enumerate(axes):
        record['axes'][row] = axis
    return record
