"""Kinematics of rigid bodies: points, heights above the ground, joint gaps, damping rates."""
import math
from collections.abc import Iterator, Sequence

import numpy as np

from ..model import rotation
from ..model.mesh import Hull
from ..model.pose import Pose
from ..model.ragdoll import Ragdoll
from ..model.rotation import IDENTITY
from ..model.scene import Scene
from ..model.shapes import Part, support_distance
from ..model.state import State
from ..model.vectors import Quaternion


def damping_rate(scene: Scene) -> float:
    """Largest decay rate c / I, 1/s, of the joints' damping c, by an estimate of I.

    I is the reduced inertia of parent and child about a joint's axis; the estimate takes both about
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


class GroundHeights:
    """Computes the height of each bone's lowest point; equal dolls share their shape tables."""

    def __init__(self, scene: Scene) -> None:
        self._ground, self._count = scene.ground, len(scene.bones)
        dolls = [placement.doll for placement in scene.dolls]
        equal = {id(doll): doll for doll in dolls}
        tables = {key: _parts(doll) for key, doll in equal.items()}
        bones, self._supports, self._positions, self._turns = (
            np.concatenate(rows) for rows in zip(*(tables[id(doll)] for doll in dolls),
                                                 strict=True))
        self._bones = bones + np.repeat([own.start for own in scene.bone_slices],
                                        [len(tables[id(doll)][0]) for doll in dolls])
        self._first = np.searchsorted(self._bones, np.arange(self._count))

    def __call__(self, state: State) -> np.ndarray:
        """Height (n,) m of each bone's lowest point above the ground; infinite without ground."""
        if self._ground is None:
            return np.full(self._count, math.inf)
        normal = np.array(self._ground.normal)
        down = -np.einsum('i,nij->nj', normal, state.rotation_matrices)[self._bones]
        reach = (down * self._positions).sum(axis=1) + support_distance(
            self._supports, np.einsum('pj,pji->pi', down, self._turns))
        return ((state.positions * normal).sum(axis=1) - self._ground.offset
                - np.maximum.reduceat(reach, self._first))


def _parts(doll: Ragdoll) -> tuple[np.ndarray, ...]:
    """Bone index (p,), arguments (p, 6) m of support_distance, position (p, 3) m and rotation
    matrix (p, 3, 3) in the bone's frame, of each of a doll's p convex shapes and vertices of hulls.
    """
    parts = [(index, *row) for index, bone in enumerate(doll.bones) for part in bone.shape.parts
             for row in _support_rows(part)]
    bones, terms, positions, orientations = zip(*parts, strict=True)
    return np.array(bones), np.array(terms), np.array(positions), rotation.matrix(orientations)


def _support_rows(part: Part) -> Iterator[tuple[Sequence[float], Sequence[float], Quaternion]]:
    """Support terms, position and orientation of a part; of a hull, those of each vertex."""
    if isinstance(part.shape, Hull):
        for vertex in part.pose.apply(part.shape.vertices):
            yield (0.0,) * 6, vertex, IDENTITY
    else:
        yield part.shape.support_terms, part.position, part.orientation


class JointGap:
    """Computes the distances between the two anchors of each of a scene's j joints."""

    def __init__(self, scene: Scene) -> None:
        bones, points = [], []
        for placement, own in zip(scene.dolls, scene.bone_slices, strict=True):
            index = {bone.name: i for i, bone in enumerate(placement.doll.bones, own.start)}
            for joint in placement.doll.joints:
                pair = [placement.doll.bone(name) for name in (joint.parent, joint.child)]
                bones.append([index[bone.name] for bone in pair])
                points.append([bone.pose.apply_inverse(joint.anchor) for bone in pair])
        self._bones = np.array(bones, int).reshape(-1, 2)
        self._points = np.array(points).reshape(-1, 2, 3)

    def gaps(self, state: State) -> np.ndarray:
        """Distances (j,) m between anchors, in the dolls' order of joints."""
        return self.of_rows(state.rows)

    def of_rows(self, rows: np.ndarray) -> np.ndarray:
        """As `gaps`, (k, j) m, of k states; ``rows`` (k, n, 13) as State.rows."""
        poses = rows[..., self._bones, :7]
        seen = Pose(poses[..., :3], poses[..., 3:]).apply(self._points)
        return np.linalg.norm(seen[..., 0, :] - seen[..., 1, :], axis=-1)
