"""Kinematics of points of rigid bodies, cross products of rows, joint damping rates."""
from __future__ import annotations

import numpy as np

from ..model import rotation
from ..model.scene import Scene
from ..model.state import State


def damping_rate(scene: Scene) -> float:
    """Upper bound on the decay rate c / I, 1/s, of the joints' damping c.

    I is the reduced inertia of parent and child about a joint's axis; the bound takes both about
    their own centres of mass: 1/I = 1/Ia + 1/Ib.
    """
    fastest = 0.0
    for placement in scene.dolls:
        doll = placement.doll
        turns = {bone.name: rotation.matrix(bone.orientation) for bone in doll.bones}
        inertias = {bone.name: np.array(bone.inertia) for bone in doll.bones}
        for joint in doll.joints:
            axes = np.eye(3) if joint.kind == 'ball' else joint.axes
            for axis in axes if joint.damping else ():
                ease = sum(1 / (inertias[name] @ (np.array(axis) @ turns[name]) ** 2)
                           for name in (joint.parent, joint.child))
                fastest = max(fastest, joint.damping * float(ease))
    return fastest


def point_motion(state: State, bone: int, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """World position (3,) m and velocity (3,) m/s of a ``point`` (3,) m in a bone's frame."""
    if not point.any():
        return state.positions[bone], state.linear_velocities[bone]
    arm = state.rotation_matrices[bone] @ point
    return (state.positions[bone] + arm,
            state.linear_velocities[bone] + cross(state.angular_velocities[bone], arm))


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross products of rows (..., 3); five times faster than np.cross on few rows."""
    out = np.empty(np.broadcast_shapes(np.shape(a), np.shape(b)))
    out[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    out[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    out[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return out
