"""Skins of fitted characters as skinned meshes, driven by bones and by links of swings."""
from __future__ import annotations

import itertools

import numpy as np
import viser

from ...fit.skin import skin_of
from ...model import errors
from ...model.link_frames import LinkFrames
from ...model.pose import Pose
from ...model.scene import Scene
from ...model.skeleton import Skin
from ...model.state import State
from ...recordings.gltf.gltf_skin import group_by_material, surface_glb
from .bodies import WXYZ

MAX_SKINS = 30
"""At once: each sends a message for every bone in each frame."""


NAMES = map('/scene/skins/{}'.format, itertools.count())
"""Of nodes. None is used twice: a page would keep the materials of the skin before, whose groups
the next one lacks, and draw nothing."""


class SkinMeshes:
    """Skins of the first MAX_SKINS dolls of a scene that have one.

    ``notes``: on skins that failed or are too many; ``skinned``: indices of the bones of dolls with
    a skin mesh; ``links``: indices of the links of swings that move one.
    """

    def __init__(self, server: viser.ViserServer, scene: Scene) -> None:
        self.notes: list[str] = []
        self.handles: list[viser.MeshSkinnedHandle] = []
        self.skinned: set[int] = set()
        self.links: list[int] = []
        self._frames = LinkFrames(scene)
        self._skins: list[tuple[Skin, slice, slice]] = []
        """With the doll's ranges among bones and links."""
        for placement, part, links in zip(scene.dolls, scene.bone_slices, scene.link_slices,
                                          strict=True):
            try:
                skin = skin_of(placement.doll)
            except errors.RagdollError as error:
                self.notes.append(f'no skin for {placement.name}: {error}')
                skin = None
            if skin is None:
                continue
            if len(self.handles) == MAX_SKINS:
                self.notes.append(f'skins of {MAX_SKINS} dolls: the others show their bones')
                break
            self._add(server, next(NAMES), skin)
            self._skins.append((skin, part, links))
            self.links += (links.start + skin.links).tolist()
            self.skinned.update(range(part.start, part.stop))

    def show(self, state: State, rods: np.ndarray | None = None) -> None:
        """Draw all skins at a state; ``rods`` (m, 2, 3) m are the swings', if they are known."""
        if not self.handles:
            return
        bones = state.poses(slice(None))
        links = self._frames.poses(bones, rods)
        for handle, (skin, own, swings) in zip(self.handles, self._skins, strict=True):
            poses = skin.joint_poses(Pose(*(part[own] for part in bones)),
                                     Pose(*(part[swings] for part in links)))
            positions = poses.position.tolist()
            wxyzs = poses.orientation[:, WXYZ].tolist()
            for joint, position, wxyz in zip(handle.bones, positions, wxyzs, strict=True):
                joint.position, joint.wxyz = tuple(position), tuple(wxyz)

    def set_visible(self, visible: bool) -> None:
        """Show or hide the skins."""
        for handle in self.handles:
            handle.visible = visible

    def _add(self, server: viser.ViserServer, name: str, skin: Skin) -> None:
        self.handles.append(server.scene.add_mesh_skinned(
            name, skin.vertices, group_by_material(skin)[0], color=skin.color[:3], side='double',
            bone_wxyzs=skin.orientations[:, WXYZ], bone_positions=skin.positions,
            skin_weights=skin.weights))
        if skin.appearance is not None:
            server.scene.add_glb(f'{name}/materials', surface_glb(skin), visible=False,
                                 cast_shadow=False)
