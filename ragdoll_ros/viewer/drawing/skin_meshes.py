"""Skins of fitted characters as skinned meshes, driven by the bones."""
from __future__ import annotations

import itertools

import numpy as np
import viser

from ...fit.skin import skin_of
from ...model import errors
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

    ``notes``: on skins that failed or are too many; ``skinned``: bones of dolls with a skin mesh.
    """

    def __init__(self, server: viser.ViserServer, scene: Scene) -> None:
        self.notes: list[str] = []
        self.handles: list[viser.MeshSkinnedHandle] = []
        self.skinned: set[int] = set()
        self._bones: list[np.ndarray] = []
        for placement, part in zip(scene.dolls, scene.bone_slices, strict=True):
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
            self._bones.append(part.start + skin.bones)
            self.skinned.update(range(part.start, part.stop))

    def show(self, state: State) -> None:
        """Draw all skins at a state."""
        for handle, bones in zip(self.handles, self._bones, strict=True):
            positions = state.positions[bones].tolist()
            wxyzs = state.orientations[bones][:, WXYZ].tolist()
            for bone, position, wxyz in zip(handle.bones, positions, wxyzs, strict=True):
                bone.position, bone.wxyz = tuple(position), tuple(wxyz)

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
