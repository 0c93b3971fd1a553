"""Local transforms over time of the nodes of a character's file, as its doll carries its bones.

From the top down, each bone is placed in its parent as the parent is written, with 32 bits. So
rounding errors do not add up along a limb.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...model import errors, rotation
from ...model.pose import Pose
from ..file_skeleton import FileSkeleton
from ..recording import points_y_up
from .animation import continuous

UNIT_SCALE = 1e-6
"""Deviation of a scale from 1 that is the rounding of 32 bits in inverse bind matrices."""

SMALLEST = 1e-30
"""Determinant of a parent's transform, as of inverse bind matrices."""


@dataclass(frozen=True)
class LocalMotion:
    """Translations (k, 3) and rotations (k, 4), float32, and the scale (3,) of a node.

    What does not move has k = 1, float64.
    """

    translation: np.ndarray
    rotation: np.ndarray
    scale: np.ndarray

    @property
    def matrices(self) -> np.ndarray:
        """Transforms (k, 4, 4) from the node's frame to its parent's."""
        found = np.zeros((len(self.rotation), 4, 4))
        found[:, :3, :3] = rotation.matrix(rotation.normalized(self.rotation.astype(float)))
        found[:, :3, :3] *= self.scale
        found[:, :3, 3], found[:, 3, 3] = self.translation, 1
        return found

    def rounded(self) -> LocalMotion:
        """The same with 32 bits, as an animation has it."""
        return LocalMotion(self.translation.astype(np.float32),
                           continuous(self.rotation).astype(np.float32), self.scale)

    def entry(self) -> dict[str, list[float]]:
        """The first instant as properties of a node."""
        scale = {} if (self.scale == 1).all() else {'scale': self.scale.tolist()}
        return {'translation': self.translation[0].tolist(),
                'rotation': self.rotation[0].tolist(), **scale}


def doll_node(skeleton: FileSkeleton, places: np.ndarray) -> LocalMotion:
    """Return the transform of the doll's node above all nodes of the file: units and axes.

    It places the parent of the first bone at the middle of the bones' ``places`` (k, n, 3) m, Y up;
    its translation is rounded to whole metres. A bone is written relative to its parent, with 32
    bits, so the parent should be near it.
    """
    matrix = np.eye(4)
    matrix[:3, :3] = points_y_up(skeleton.to_doll[:3, :3].T).T
    nodes = skeleton.source.nodes
    above = nodes.parents[skeleton.nodes[0]]
    middle = (places.max(axis=(0, 1)) + places.min(axis=(0, 1))) / 2
    if above >= 0:
        middle = middle - matrix[:3, :3] @ nodes.worlds[above][:3, 3]
    matrix[:3, 3] = np.round(middle)
    return decomposed(matrix[None])


def bone_motions(skeleton: FileSkeleton, poses: Pose,
                 root: LocalMotion) -> dict[int, tuple[bool, LocalMotion]]:
    """Return whether each bone moves in its parent, and its motion there, by its node.

    Args:
        skeleton: of the file.
        poses: (k, n) of its bones, world frame.
        root: transform of the node above all of the file's.

    Raises:
        WrongForm: a node above a bone has a scale of zero.
    """
    nodes = skeleton.source.nodes
    bone_of = {node: bone for bone, node in enumerate(skeleton.nodes)}
    own = _matrices(rotation.matrix(skeleton.offsets.orientation) @ skeleton.stretches,
                    skeleton.offsets.position)
    worlds: dict[int, np.ndarray] = {-1: root.matrices}
    # Carrier of the nearest bone above, and the transform from the node to it.
    carried: dict[int, tuple[int, np.ndarray]] = {-1: (-1, np.eye(4))}
    found = {}
    for node in nodes.order:
        up = nodes.parents[node]
        bone = bone_of.get(node)
        if bone is None:
            carried[node] = carried[up][0], carried[up][1] @ nodes.locals[node]
            worlds[node] = worlds[up] @ nodes.locals[node]
            continue
        moves = carried[up][0] != skeleton.carriers[bone]
        above = worlds[up] if moves else carried[up][1]
        if not (np.abs(np.linalg.det(above)) > SMALLEST).all():
            raise errors.WrongForm(f'nodes[{up}]', 'a scale of zero', 'nodes that give the bones '
                                   'below an extent')
        if moves:
            turned = rotation.matrix(poses.orientation[:, bone]) @ skeleton.stretches[bone]
            there = _matrices(points_y_up(np.swapaxes(turned, 1, 2)).swapaxes(1, 2),
                              points_y_up(poses.position[:, bone]))
            motion = decomposed(np.linalg.inv(above) @ there).rounded()
        else:
            motion = decomposed((np.linalg.inv(above) @ own[bone])[None])
        carried[node] = int(skeleton.carriers[bone]), own[bone]
        worlds[node] = worlds[up] @ motion.matrices
        found[node] = moves, motion
    return found


def decomposed(matrices: np.ndarray) -> LocalMotion:
    """Transforms (k, 4, 4) as translations, rotations and the first one's scale.

    Of a shear only the nearest rotation is taken. A reflection is one of the x axis.
    """
    linear = matrices[:, :3, :3]
    mirror = np.array([np.sign(np.linalg.det(linear[0])), 1, 1])
    turns = rotation.nearest_rotation(linear * mirror)
    scale = np.diag(rotation.matrix(turns[0]).T @ linear[0]).copy()
    scale[np.abs(scale - 1) < UNIT_SCALE] = 1
    return LocalMotion(matrices[:, :3, 3], turns, scale)


def _matrices(linear: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Transforms (k, 4, 4) of linear parts (k, 3, 3) and positions (k, 3)."""
    found = np.zeros((len(linear), 4, 4))
    found[:, :3, :3], found[:, :3, 3], found[:, 3, 3] = linear, positions, 1
    return found
