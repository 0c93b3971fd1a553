"""A scene's dolls as one table for compiled code: a record for each bone, parents first."""
from __future__ import annotations

import numpy as np

from ..model.ragdoll import Joint, Ragdoll, joint_axes
from ..model.scene import Scene
from .kernels.record import RECORD


def table(scene: Scene) -> np.ndarray:
    """Records of all bones of a scene, coordinates in the order of DofLayout."""
    places = {name: place for place, name in enumerate(scene.bone_names)}
    records: list[np.ndarray] = []
    q = v = 0
    for placement in scene.dolls:
        doll, at = placement.doll, {}
        for joint in (None, *doll.joints_depth_first()):
            bone = doll.bone(joint.child) if joint else doll.root
            record = np.zeros((), RECORD)
            record['parent'], record['free'] = -1, 1
            if joint:
                _enter_joint(record, doll, joint, at)
            record['bone'] = places[scene.qualified(placement, bone.name)]
            record['mass'], record['inertia'] = bone.mass, bone.inertia
            record['bind'], record['q'], record['v'] = bone.orientation, q, v
            at[bone.name] = len(records)
            records.append(record)
            if joint is None:
                q, v = q + 7, v + 6
            else:
                q, v = q + (4 if record['free'] else joint.dof), v + joint.dof
    return np.array(records, RECORD)


def _enter_joint(record: np.ndarray, doll: Ragdoll, joint: Joint, at: dict[str, int]) -> None:
    """Enter what a joint says of its child's record; ``at``: which record is whose."""
    record['parent'] = at[joint.parent]
    record['free'] = joint.is_free_ball
    record['dof'], record['damping'] = joint.dof, joint.damping
    record['before'] = np.subtract(joint.anchor, doll.bone(joint.parent).position)
    record['after'] = np.subtract(doll.bone(joint.child).position, joint.anchor)
    record['axes'][:joint.dof] = joint_axes(joint)
