"""The skin of a fitted character, following the bones.

All riders that one bone carries move as one rigid thing, so that the page needs no more than the
bones that carry any: with T_b the bone's pose and W_b the sum of its riders' weights, a vertex v
of the bind pose stands at sum of W_b T_b inv(T_b at the start) v (riders.py, added up by bone).
"""
from __future__ import annotations

import functools
import os
from dataclasses import dataclass

import numpy as np
import viser

from ...fit.reading.character import Character, read_character
from ...model import errors, rotation
from ...model.ragdoll import Ragdoll
from ...model.scene import Placement, Scene
from ...model.skeleton import Riders
from ...model.state import State
from .bodies import WXYZ

COLOR = (205, 190, 175)

MOST = 30
"""Skins at once: each has a message for every bone in each picture."""

SCALE = 1e-3
"""Share by which a skin's size may miss the doll's before it is read again in the doll's."""

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


@dataclass(frozen=True)
class Skin:
    """A doll's skin in its bind pose, doll's frame.

    ``bones`` (b,) are the doll's bones that carry riders, ``weights`` (v, b) theirs. ``positions``
    (b, 3) m and ``orientations`` (b, 4) are where these bones were when the skin was bound to
    them: in the doll's bind pose, unless a limb has been moved with its skin since.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    bones: np.ndarray
    weights: np.ndarray
    positions: np.ndarray
    orientations: np.ndarray


def skin_of(doll: Ragdoll) -> Skin | None:
    """Skin of a doll; None if it names no character, RagdollError if it does not fit."""
    if doll.model is None or not doll.riders:
        return None
    character = _read(doll.model)
    size = _size(doll, character)
    if abs(size - 1) > SCALE:
        character = _read(doll.model, character.scale * size)
    index = {bone.name: k for k, bone in enumerate(doll.bones)}
    carrier = {rider.name: index[rider.bone] for rider in doll.riders}
    missing = [name for name in character.bone_names if name not in carrier]
    if missing:
        raise errors.UnknownBone('riders', missing[0], f'a doll that was fitted to {doll.model}')
    carriers = np.array([carrier[name] for name in character.bone_names])
    bones, slots = np.unique(carriers, return_inverse=True)
    weights = np.zeros((len(character.vertices), len(bones)))
    rows = np.arange(len(weights))[:, None]
    np.add.at(weights, (rows, slots[character.bones]), character.weights)
    weights[weights.sum(axis=1) == 0, 0] = 1
    return Skin(character.vertices, character.triangles, bones, weights,
                *_bound(doll, character, bones))


def _read(path: str, scale: float | None = None) -> Character:
    """Read a character once: an edited doll comes again and again with the same."""
    try:
        stat = os.stat(path)
    except (OSError, ValueError):
        # Reading it says what is wrong.
        return read_character(path, scale)
    return _read_once(path, scale, (stat.st_mtime_ns, stat.st_size))


@functools.lru_cache(maxsize=4)
def _read_once(path: str, scale: float | None, _: tuple[int, int]) -> Character:
    return read_character(path, scale)


def _bound(doll: Ragdoll, character: Character, bones: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Poses of bodies from those of the character's bones that ride on them."""
    place = {name: k for k, name in enumerate(character.bone_names)}
    riders = {rider.bone: rider for rider in reversed(doll.riders) if rider.name in place}
    riders.update({rider.bone: rider for rider in doll.riders if rider.name == rider.bone})
    carried = [riders[doll.bones[index].name] for index in bones]
    back = rotation.inverse(np.array([rider.orientation for rider in carried]))
    at = [place[rider.name] for rider in carried]
    orientations = rotation.multiply(character.orientations[at], back)
    local = np.array([rider.position for rider in carried])
    return character.positions[at] - rotation.rotate(orientations, local), orientations


def _size(doll: Ragdoll, character: Character) -> float:
    """How much longer the bones of the doll's riders are than the character's: most of them.

    Not how far apart they stand: limbs may have been moved.
    """
    poses = State(np.array([bone.position for bone in doll.bones]),
                  np.array([bone.orientation for bone in doll.bones]),
                  *np.zeros((2, len(doll.bones), 3)))
    positions, _ = Riders(Scene('bind', (Placement(doll),))).poses(poses)
    place = {rider.name: k for k, rider in enumerate(doll.riders)}
    edges = np.array([(place[name], place[character.bone_names[up]], bone, up)
                      for bone, (name, up) in enumerate(zip(
                          character.bone_names, character.parents, strict=True))
                      if up >= 0 and name in place and character.bone_names[up] in place])
    if not len(edges):
        return 1.0
    ours = np.linalg.norm(positions[edges[:, 0]] - positions[edges[:, 1]], axis=1)
    theirs = np.linalg.norm(character.positions[edges[:, 2]] - character.positions[edges[:, 3]],
                            axis=1)
    some = theirs > 1e-3 * theirs.max()
    return float(np.median(ours[some] / theirs[some])) if some.any() else 1.0


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
            name, skin.vertices, skin.triangles, color=COLOR, side='double',
            bone_wxyzs=skin.orientations[:, WXYZ], bone_positions=skin.positions,
            skin_weights=skin.weights))
