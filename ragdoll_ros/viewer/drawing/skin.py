"""The skins of fitted characters, following the bones."""
from __future__ import annotations

import numpy as np
import viser

from ...fit.skin import skin_of
from ...model import errors
from ...model.scene import Scene
from ...model.skeleton import Skin
from ...model.state import State
from ...recordings.gltf.gltf_skin import group_by_material, surface_glb
from .bodies import WXYZ

MOST = 30
"""Skins at once: each has a message for every bone in each picture."""

KEEP_PAGE = """<img src="data:," style="display:none" onerror="
  (function guard() {
    const viewer = window.__viserMutable;
    if (!viewer) return setTimeout(guard, 50);
    if (viewer.ragdollGuard) return;
    viewer.ragdollGuard = true;
    viewer.nodeRefFromName = new Proxy(viewer.nodeRefFromName,
                                       {get: (nodes, name) => nodes[name] ?? undefined});
  })()">"""
"""Keeps a page alive when a skin goes, or the line to the server does. Viser 1.1.1 ends the whole
page then: as it takes a skinned mesh away it asks a node that is null, not undefined, already."""


class Skins:
    """The skins of a scene's dolls, of the first MOST that have one.

    ``notes`` tells of those that failed, or are too many; ``clad`` are the indices of all bones of
    dolls that show their skin.
    """

    def __init__(self, server: viser.ViserServer, scene: Scene) -> None:
        self.notes: list[str] = []
        self.handles: list[viser.MeshSkinnedHandle] = []
        self.clad: set[int] = set()
        self._bones: list[np.ndarray] = []
        for number, (placement, part) in enumerate(
                zip(scene.dolls, scene.bone_slices, strict=True)):
            try:
                skin = skin_of(placement.doll)
            except errors.RagdollError as error:
                self.notes.append(f'no skin for {placement.name}: {error}')
                skin = None
            if skin is None:
                continue
            if len(self.handles) == MOST:
                self.notes.append(f'skins of {MOST} dolls: the others show their bones')
                break
            self._add(server, f'/scene/skins/{number}', skin)
            self._bones.append(part.start + skin.bones)
            self.clad.update(range(part.start, part.stop))

    def show(self, state: State) -> None:
        """Draw all skins where their bones are now."""
        for handle, bones in zip(self.handles, self._bones, strict=True):
            positions = state.positions[bones].tolist()
            wxyzs = state.orientations[bones][:, WXYZ].tolist()
            for bone, position, wxyz in zip(handle.bones, positions, wxyzs, strict=True):
                bone.position, bone.wxyz = tuple(position), tuple(wxyz)

    def be_visible(self, wanted: bool) -> None:
        """Show the skins, or hide them."""
        for handle in self.handles:
            handle.visible = wanted

    def _add(self, server: viser.ViserServer, name: str, skin: Skin) -> None:
        self.handles.append(server.scene.add_mesh_skinned(
            name, skin.vertices, group_by_material(skin)[0], color=skin.color[:3], side='double',
            bone_wxyzs=skin.orientations[:, WXYZ], bone_positions=skin.positions,
            skin_weights=skin.weights))
        if skin.appearance is not None:
            server.scene.add_glb(f'{name}/paint', surface_glb(skin), visible=False,
                                 cast_shadow=False)
