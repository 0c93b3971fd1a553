"""The bones: all parts of one kind are one batch, so that hundreds cost as little as ten."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import viser

from ...model.pose import Pose
from ...model.ragdoll import DEFAULT_COLOR
from ...model.scene import Scene
from ...model.state import State
from .meshes import MESHES

GLASS = 0.45
"""Opacity of bones through which their skin is to be seen."""

WXYZ = [3, 0, 1, 2]
"""Viser's order of a quaternion, from ours."""


@dataclass(frozen=True)
class Batch:
    """Parts of one kind: which bone each is of, and its pose (p,) in that one's frame."""

    handle: viser.BatchedMeshHandle
    bones: np.ndarray
    within: Pose | None
    """None where all are the bones themselves: most are, and this runs with every frame."""


class Bodies:
    """Every bone of a scene in its own shape and colour."""

    def __init__(self, server: viser.ViserServer, scene: Scene, state: State) -> None:
        parts = [(index, part) for index, bone in enumerate(scene.bones)
                 for part in bone.shape.primitives]
        colors = np.array([(bone.color or DEFAULT_COLOR)[:3] for bone in scene.bones])
        self.batches: list[Batch] = []
        for kind, (vertices, faces) in MESHES.items():
            mine = [(index, part) for index, part in parts if part.kind == kind]
            if not mine:
                continue
            bones = np.array([index for index, _ in mine])
            within = None if all(part.is_centred for _, part in mine) else Pose(
                np.array([part.position for _, part in mine]),
                np.array([part.orientation for _, part in mine]))
            positions, wxyzs = _placed(state, bones, within)
            handle = server.scene.add_batched_meshes_simple(
                f'/scene/bodies/{kind}', vertices, faces, wxyzs, positions,
                batched_scales=np.array([part.size for _, part in mine]),
                batched_colors=np.round(colors[bones] * 255).astype(np.uint8), lod='off')
            self.batches.append(Batch(handle, bones, within))

    def show(self, state: State) -> None:
        """Draw all where they are now."""
        for batch in self.batches:
            positions, wxyzs = _placed(state, batch.bones, batch.within)
            batch.handle.batched_positions = positions
            batch.handle.batched_wxyzs = wxyzs

    def be_visible(self, wanted: bool, glass: bool) -> None:
        """Show the bones, as of glass if so wished, or hide them."""
        for batch in self.batches:
            batch.handle.visible = wanted
            batch.handle.opacity = GLASS if glass else None


def _placed(state: State, bones: np.ndarray,
            within: Pose | None) -> tuple[np.ndarray, np.ndarray]:
    """Positions (p, 3) m and orientations (p, 4) w, x, y, z of parts, float32."""
    pose = state.poses(bones)
    if within is not None:
        pose = pose.compose(within)
    return pose.position.astype(np.float32), pose.orientation[:, WXYZ].astype(np.float32)
