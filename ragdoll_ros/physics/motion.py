"""How dolls move as a whole, and how points of bones do: values, and sums over rigid bodies."""
from __future__ import annotations

import numpy as np

from ..model import rotation
from ..model.scene import Scene
from ..model.state import State


class Motion:
    """Where each of d dolls is as a whole, and how it moves; sums over its bones, world frame."""

    def __init__(self, energy: np.ndarray, kinetic: np.ndarray, centre: np.ndarray,
                 momentum: np.ndarray, angular_momentum: np.ndarray, inertia: np.ndarray) -> None:
        self.sums = np.concatenate([energy[:, None], kinetic[:, None], centre, momentum,
                                    angular_momentum, inertia.reshape(-1, 9)], axis=1)
        """(d, 20): all these side by side."""

    @classmethod
    def of(cls, sums: np.ndarray) -> Motion:
        """From rows (d, 20) of all these, as they are."""
        motion = cls.__new__(cls)
        motion.sums = sums
        return motion

    @property
    def energy(self) -> np.ndarray:
        """(d,) J: kinetic energy plus that of height, zero where the world's origin is."""
        return self.sums[:, 0]

    @property
    def kinetic(self) -> np.ndarray:
        """(d,) J: kinetic energy."""
        return self.sums[:, 1]

    @property
    def centre(self) -> np.ndarray:
        """(d, 3) m: centre of mass."""
        return self.sums[:, 2:5]

    @property
    def momentum(self) -> np.ndarray:
        """(d, 3) N s: linear momentum."""
        return self.sums[:, 5:8]

    @property
    def angular_momentum(self) -> np.ndarray:
        """(d, 3) N m s about the doll's own centre of mass."""
        return self.sums[:, 8:11]

    @property
    def inertia(self) -> np.ndarray:
        """(d, 3, 3) kg m^2 about that centre, as if the doll's joints were locked in its pose."""
        return self.sums[:, 11:20].reshape(-1, 3, 3)


def damping_rate(scene: Scene) -> float:
    """Fastest rate, 1/s, at which the joints' damping c ends a motion: a bound on c / I.

    I is the inertia in which two bones turn against each other about the joint's axis, at the
    least that of both about their own centres of mass: 1/I = 1/Ia + 1/Ib.
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
    """Position (3,) m and velocity (3,) m/s of a point of a bone, given along its axes."""
    if not point.any():
        return state.positions[bone], state.linear_velocities[bone]
    arm = state.rotation_matrices[bone] @ point
    return (state.positions[bone] + arm,
            state.linear_velocities[bone] + cross(state.angular_velocities[bone], arm))


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross products of rows (..., 3); numpy's own costs five times as much on few rows."""
    out = np.empty(np.broadcast_shapes(np.shape(a), np.shape(b)))
    out[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    out[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    out[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return out
