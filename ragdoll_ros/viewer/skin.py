"""The skin of a fitted character, following the bones.

All riders that one bone carries move as one rigid thing, so that the page needs no more than the
bones that carry any: with T_b the bone's pose and W_b the sum of its riders' weights, a vertex v
of the bind pose stands at sum of W_b T_b inv(T_b at the start) v (riders.py, added up by bone).
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import viser

from .. import faults
from ..fit.character import Character, read_character
from ..ragdoll import Ragdoll
from ..scene import Scene
from ..state import State
from .bodies import WXYZ

COLOR = (205, 190, 175)

SCALE = 1e-3
"""Share by which a skin's size may miss the doll's before it is read again in the doll's."""


@dataclass(frozen=True)
class Skin:
    """A doll's skin in its bind pose, doll's frame.

    ``bones`` (b,) are the doll's bones that carry riders, ``weights`` (v, b) theirs.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    bones: np.ndarray
    weights: np.ndarray


def skin_of(doll: Ragdoll) -> Skin | None:
    """Read the skin of a doll; None if it names no character, RagdollError if it does not fit."""
    if doll.model is None or not doll.riders:
        return None
    character = read_character(doll.model)
    size = _size(doll, character)
    if abs(size - 1) > SCALE:
        character = read_character(doll.model, character.scale * size)
    index = {bone.name: k for k, bone in enumerate(doll.bones)}
    carrier = {rider.name: index[rider.bone] for rider in doll.riders}
    missing = [name for name in character.bone_names if name not in carrier]
    if missing:
        raise faults.UnknownBone('riders', missing[0], f'a doll that was fitted to {doll.model}')
    carriers = np.array([carrier[name] for name in character.bone_names])
    bones, slots = np.unique(carriers, return_inverse=True)
    weights = np.zeros((len(character.vertices), len(bones)))
    rows = np.arange(len(weights))[:, None]
    np.add.at(weights, (rows, slots[character.bones]), character.weights)
    weights[weights.sum(axis=1) == 0, 0] = 1
    return Skin(character.vertices, character.triangles, bones, weights)


def _size(doll: Ragdoll, character: Character) -> float:
    """How much larger the doll's riders stand apart than the character's bones."""
    from ..riders import Riders
    from ..scene import Placement
    poses = State(np.array([bone.position for bone in doll.bones]),
                  np.array([bone.orientation for bone in doll.bones]),
                  np.zeros((0, 3)), np.zeros((0, 3)))
    positions, _ = Riders(Scene('bind', (Placement(doll),))).poses(poses)
    names = [rider.name for rider in doll.riders]
    both = [name for name in names if name in character.bone_names]
    if len(both) < 2:
        return 1.0
    ours = positions[[names.index(name) for name in both]]
    theirs = character.positions[[character.bone_names.index(name) for name in both]]
    spread = np.ptp(theirs, axis=0).max()
    return float(np.ptp(ours, axis=0).max() / spread) if spread > 0 else 1.0


class Skins:
    """The skins of all dolls of a scene that have one; ``notes`` tells of those that failed."""

    def __init__(self, server: viser.ViserServer, scene: Scene) -> None:
        self.notes: list[str] = []
        self.handles: list[viser.MeshSkinnedHandle] = []
        self._bones: list[np.ndarray] = []
        first = 0
        for number, placement in enumerate(scene.dolls):
            try:
                skin = skin_of(placement.doll)
            except faults.RagdollError as error:
                self.notes.append(f'no skin for {placement.name}: {error}')
                skin = None
            if skin is not None:
                self._add(server, f'/scene/skins/{number}', placement.doll, skin)
                self._bones.append(first + skin.bones)
            first += len(placement.doll.bones)

    def show(self, state: State) -> None:
        """Let all skins follow."""
        for handle, bones in zip(self.handles, self._bones, strict=True):
            positions = state.positions[bones].tolist()
            turns = state.orientations[bones][:, WXYZ].tolist()
            for bone, position, turn in zip(handle.bones, positions, turns, strict=True):
                bone.position, bone.wxyz = tuple(position), tuple(turn)

    def be_visible(self, wanted: bool) -> None:
        """Show the skins, or hide them."""
        for handle in self.handles:
            handle.visible = wanted

    def _add(self, server: viser.ViserServer, name: str, doll: Ragdoll, skin: Skin) -> None:
        bones = [doll.bones[index] for index in skin.bones]
        self.handles.append(server.scene.add_mesh_skinned(
            name, skin.vertices, skin.triangles, color=COLOR, side='double',
            bone_wxyzs=np.array([bone.orientation for bone in bones])[:, WXYZ],
            bone_positions=np.array([bone.position for bone in bones]),
            skin_weights=skin.weights))
