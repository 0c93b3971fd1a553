"""The skin of a fitted character, as its doll's bones move it.

All riders that one bone carries move as one rigid thing, so that a page or a file needs no more
than the bones that carry any: with T_b the bone's pose and W_b the sum of its riders' weights, a
vertex v of the bind pose stands at sum of W_b T_b inv(T_b at the start) v (model/skeleton.py, added
up by bone).
"""
from __future__ import annotations

import functools
import os
from collections.abc import Callable

import numpy as np

from ..model import errors, rotation
from ..model.ragdoll import Ragdoll
from ..model.scene import Placement, Scene
from ..model.skeleton import Riders
from ..model.skin import Skin
from ..model.state import State
from .reading.character import Character, read_character
from .reading.part import part_of

SCALE = 1e-3
"""Share by which a skin's size may miss the doll's before it is read again in the doll's."""


def skin_of(doll: Ragdoll) -> Skin | None:
    """Skin of a doll; None if it names no character, RagdollError if it does not fit."""
    if doll.model is None or not doll.riders:
        return None
    character = _read(doll.model)
    size = _size(doll, character)
    if abs(size - 1) > SCALE:
        character = _read(doll.model, character.scale * size)
    character = _worn(doll, character)
    index = {bone.name: k for k, bone in enumerate(doll.bones)}
    carrier = {rider.name: index[rider.bone] for rider in doll.riders}
    carriers = np.array([carrier[name] for name in character.bone_names])
    bones, slots = np.unique(carriers, return_inverse=True)
    weights = np.zeros((len(character.vertices), len(bones)))
    rows = np.arange(len(weights))[:, None]
    np.add.at(weights, (rows, slots[character.bones]), character.weights)
    weights[weights.sum(axis=1) == 0, 0] = 1
    return Skin(character.vertices, character.triangles, bones, weights,
                *_bound(doll, character, bones), character.appearance)


def skins_of(scene: Scene, warn: Callable[[str], None]) -> dict[int, Skin]:
    """Skins of those dolls that have one, by their index; ``warn`` is told of those that fail."""
    found: dict[int, Skin] = {}
    for index, placement in enumerate(scene.dolls):
        try:
            skin = skin_of(placement.doll)
        except errors.RagdollError as error:
            warn(f'no skin for {placement.name}: {error}')
            continue
        if skin is not None:
            found[index] = skin
    return found


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


def _worn(doll: Ragdoll, character: Character) -> Character:
    """Of a file's characters the doll's own: that whose bones are the doll's riders.

    UnknownBone where other bones move its skin too, or where it has none.
    """
    riders = {rider.name for rider in doll.riders}
    own = np.array([name in riders for name in character.bone_names])
    if own.all():
        return character
    moved = character.weights > 0
    theirs = moved & own[character.bones]
    foreign = moved & ~own[character.bones] & theirs.any(axis=1, keepdims=True)
    if foreign.any() or not theirs.any():
        missing = character.bones[foreign] if foreign.any() else np.flatnonzero(~own)
        raise errors.UnknownBone('riders', character.bone_names[missing[0]],
                                 f'a doll that was fitted to {doll.model}')
    return part_of(character, own)


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
