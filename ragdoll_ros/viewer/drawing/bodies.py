"""The bones: many parts of one kind are one batch, so that hundreds cost as little as ten.

A batch in which nothing has moved is not sent: one doll that moves among a thousand that lie still
costs as much as the batches it is in.
"""
from __future__ import annotations

import itertools
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
import viser

from ...model.pose import Pose
from ...model.ragdoll import DEFAULT_COLOR
from ...model.scene import Scene
from ...model.shapes import Part
from ...model.state import State
from .meshes import COARSE, MESHES

GLASS = 0.45
"""Opacity of bones through which their skin is to be seen."""

MOST = 1000
"""Parts in a batch: 28 kB when it moves. Each batch costs the page some 0.4 ms by itself."""

CROWD = 1000
"""Parts from which on round ones are drawn coarsely."""

WXYZ = [3, 0, 1, 2]
"""Viser's order of a quaternion, from ours."""


@dataclass(frozen=True)
class Batch:
    """Parts of one kind: which bone each is of, and its pose (p,) in that one's frame."""

    kind: str
    clad: bool
    """Whether they are of dolls that show their skin."""
    handle: viser.BatchedMeshHandle
    bones: np.ndarray
    within: Pose | None
    """None where all are the bones themselves: most are, and this runs with every frame."""


class Bodies:
    """Every bone of a scene in its own shape and colour; those in ``clad`` are under a skin."""

    def __init__(self, server: viser.ViserServer, scene: Scene, state: State,
                 clad: Collection[int] = ()) -> None:
        self._server = server
        self.batches: list[Batch] = []
        parts = [(index, part) for index, bone in enumerate(scene.bones)
                 for part in bone.shape.primitives]
        self._meshes = MESHES if len(parts) <= CROWD else COARSE
        colors = np.array([(bone.color or DEFAULT_COLOR)[:3] for bone in scene.bones])
        for kind, under in itertools.product(MESHES, (False, True)):
            mine = [(index, part) for index, part in parts
                    if part.kind == kind and (index in clad) == under]
            for first in range(0, len(mine), MOST):
                self._add(mine[first:first + MOST], under, colors, state)

    def _add(self, some: list[tuple[int, Part]], clad: bool, colors: np.ndarray,
             state: State) -> None:
        """Add parts of one kind, each with the bone that it is of."""
        bones = np.array([index for index, _ in some])
        parts = [part for _, part in some]
        kind = parts[0].kind
        within = None if all(part.is_centred for part in parts) else Pose(
            np.array([part.position for part in parts]),
            np.array([part.orientation for part in parts]))
        positions, wxyzs = _placed(state, bones, within)
        handle = self._server.scene.add_batched_meshes_simple(
            f'/scene/bodies/{kind}_{len(self.batches)}', *self._meshes[kind], wxyzs, positions,
            batched_scales=np.array([part.size for part in parts]),
            batched_colors=np.round(colors[bones] * 255).astype(np.uint8), lod='off')
        self.batches.append(Batch(kind, clad, handle, bones, within))

    def show(self, state: State) -> None:
        """Draw all where they are now."""
        for batch in self.batches:
            positions, wxyzs = _placed(state, batch.bones, batch.within)
            batch.handle.batched_positions = positions
            batch.handle.batched_wxyzs = wxyzs

    def be_visible(self, wanted: bool, glass: bool) -> None:
        """Show the bones under skins, as of glass if so wished, or hide them; others stay."""
        for batch in self.batches:
            if batch.clad:
                batch.handle.visible = wanted
                batch.handle.opacity = GLASS if glass else None


def _placed(state: State, bones: np.ndarray,
            within: Pose | None) -> tuple[np.ndarray, np.ndarray]:
    """Positions (p, 3) m and orientations (p, 4) w, x, y, z of parts, float32."""
    pose = state.poses(bones)
    if within is not None:
        pose = pose.compose(within)
    return pose.position.astype(np.float32), pose.orientation[:, WXYZ].astype(np.float32)
