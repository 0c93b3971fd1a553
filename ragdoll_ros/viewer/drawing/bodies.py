"""The bones, as instanced meshes: parts of one shape form batches, so many parts are cheap. All
hulls of a bone form one batch.

A batch in which nothing has moved is not sent: one doll that moves among a thousand resting dolls
costs only the batches that contain it.
"""
from __future__ import annotations

import itertools
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
import viser

from ...model.compound import Compound
from ...model.mesh import Hull
from ...model.pose import Pose
from ...model.ragdoll import DEFAULT_COLOR
from ...model.scene import Scene
from ...model.shapes import Part
from ...model.state import State
from ..viser_internals import set_poses
from .joint_balls import joint_balls
from .meshes import COARSE, MESHES, Mesh, faceted

OPACITY = 0.45
"""Of bones below a visible skin."""

BATCH_SIZE = 1000
"""Most parts in a batch: 28 kB when it moves. Each batch costs the page some 0.4 ms."""

CROWD = 1000
"""Number of parts above which round ones are drawn with fewer triangles."""

WXYZ = [3, 0, 1, 2]
"""Indices that turn a quaternion xyzw into viser's wxyz."""


@dataclass(frozen=True)
class Batch:
    """p parts of one shape; ``bones``: index of the bone of each."""

    kind: str
    skinned: bool
    """Whether they are parts of dolls with a skin."""
    handle: viser.BatchedMeshHandle
    bones: np.ndarray
    local_pose: Pose | None
    """Poses (p,) in the frames of the bones; None for identity, the usual and faster case."""


class Bodies:
    """Bones of a scene in their shapes and colours; those in ``skinned`` are below a skin."""

    def __init__(self, server: viser.ViserServer, scene: Scene, state: State,
                 skinned: Collection[int] = ()) -> None:
        self._server = server
        self.batches: list[Batch] = []
        """The bones."""
        self._balls: list[Batch] = []
        """At their joints."""
        parts = [(index, part) for index, bone in enumerate(scene.bones)
                 for part in bone.shape.primitives]
        self._meshes = MESHES if len(parts) <= CROWD else COARSE
        colors = np.array([(bone.color or DEFAULT_COLOR)[:3] for bone in scene.bones])
        for index, hulls in itertools.groupby(
                ((index, part) for index, part in parts if isinstance(part.shape, Hull)),
                key=lambda pair: pair[0]):
            # A bone may have many, which move as one.
            joined = Compound(tuple(part for _, part in hulls))
            self.batches.append(self._batch(
                f'/scene/bodies/hulls_{index}', [(index, Part(joined.parts[0].shape))],
                index in skinned, colors[[index]], state, faceted(*joined.mesh())))
        for kind, below_skin in itertools.product(MESHES, (False, True)):
            selected = [(index, part) for index, part in parts
                        if part.kind == kind and (index in skinned) == below_skin]
            for first in range(0, len(selected), BATCH_SIZE):
                chunk = selected[first:first + BATCH_SIZE]
                self.batches.append(self._batch(
                    f'/scene/bodies/{kind}_{len(self.batches)}', chunk, below_skin,
                    colors[[index for index, _ in chunk]], state))
        balls = joint_balls(scene)
        for below_skin in (False, True):
            chosen = [ball for ball in balls if (ball[0] in skinned) == below_skin]
            if chosen:
                self._balls.append(self._batch(
                    f'/scene/joints/{int(below_skin)}', [(parent, ball) for parent, _, ball in
                                                         chosen], below_skin,
                    colors[[child for _, child, _ in chosen]], state))

    def _batch(self, name: str, chunk: list[tuple[int, Part]], skinned: bool, colors: np.ndarray,
               state: State, mesh: Mesh | None = None) -> Batch:
        """Make a batch of parts of one shape, each with its bone's index, in ``colors`` (p, 3).

        ``mesh``: what is drawn; required for hulls, else by default that of the parts' kind.
        """
        bones = np.array([index for index, _ in chunk])
        parts = [part for _, part in chunk]
        kind = parts[0].kind
        local_pose = None if all(part.is_centred for part in parts) else Pose(
            np.array([part.position for part in parts]),
            np.array([part.orientation for part in parts]))
        positions, wxyzs = _part_poses(state, bones, local_pose)
        scales = np.ones((1, 3)) if mesh else np.array([part.size for part in parts])
        handle = self._server.scene.add_batched_meshes_simple(
            name, *(mesh or self._meshes[kind]), wxyzs, positions, batched_scales=scales,
            batched_colors=np.round(linear(colors) * 255).astype(np.uint8), lod='off')
        return Batch(kind, skinned, handle, bones, local_pose)

    def show(self, state: State) -> None:
        """Draw a state."""
        for batch in self.batches:
            positions, wxyzs = _part_poses(state, batch.bones, batch.local_pose)
            set_poses(batch.handle, batched_positions=positions, batched_wxyzs=wxyzs)
        for batch in self._balls:  # nobody sees whether they turn
            positions, _ = _part_poses(state, batch.bones, batch.local_pose)
            set_poses(batch.handle, batched_positions=positions)

    def set_visible(self, visible: bool, translucent: bool) -> None:
        """Show or hide the bones below skins; others stay visible."""
        for batch in (*self.batches, *self._balls):
            if batch.skinned:
                batch.handle.visible = visible
                batch.handle.opacity = OPACITY if translucent else None


def linear(colors: np.ndarray) -> np.ndarray:
    """Convert colours from sRGB, 0 to 1, to linear light, which viser expects for batches."""
    return np.where(colors > 0.04045, ((colors + 0.055) / 1.055) ** 2.4, colors / 12.92)


def _part_poses(state: State, bones: np.ndarray,
                local_pose: Pose | None) -> tuple[np.ndarray, np.ndarray]:
    """Positions (p, 3) m and orientations (p, 4) wxyz of parts, float32."""
    pose = state.poses(bones)
    if local_pose is not None:
        pose = pose.compose(local_pose)
    return pose.position.astype(np.float32), pose.orientation[:, WXYZ].astype(np.float32)
