"""Skin of a fitted character, moved by its doll's bones.

All riders of a bone, or of a link of a swing, move as one rigid body. The only joints that a page
or a file needs are therefore the bones and links that carry riders. With the pose T_j of joint j
and the sum W_j of its riders' weights, a vertex v of the bind pose is at sum of W_j T_j inv(T_j in
the bind pose) v (model/skeleton.py, summed by joint).
"""
import functools
import os

import numpy as np

from ..model import errors, rotation
from ..model.pose import Pose
from ..model.ragdoll import Ragdoll
from ..model.scene import Placement, Scene
from ..model.skeleton import Riders, Skin, links_of_riders
from ..model.state import State
from ..model.swing_mount import mount_swings
from .reading.character import Character, read_character
from .skeleton.split_characters import subset_character

SCALE_TOLERANCE = 1e-3
"""Relative difference of skin and doll from which on the skin is read again at the doll's scale."""


def skin_of(doll: Ragdoll) -> Skin | None:
    """Skin of a doll; None if it names no character. Raises RagdollError if they do not match."""
    if doll.model is None or not doll.riders:
        return None
    character = _read_cached(doll.model)
    ratio = _scale_ratio(doll, character)
    if abs(ratio - 1) > SCALE_TOLERANCE:
        character = _read_cached(doll.model, character.scale * ratio)
    character = _own_character(doll, character)
    index = {bone.name: k for k, bone in enumerate(doll.bones)}
    carrier = {rider.name: index[rider.bone] for rider in doll.riders}
    # Links are joints after all bones.
    carrier |= {name: len(index) + link for name, link in links_of_riders(doll).items()}
    carriers = np.array([carrier[name] for name in character.bone_names])
    joints, slots = np.unique(carriers, return_inverse=True)
    bones, links = joints[joints < len(index)], joints[joints >= len(index)] - len(index)
    weights = np.zeros((len(character.vertices), len(joints)))
    rows = np.arange(len(weights))[:, None]
    np.add.at(weights, (rows, slots[character.bones]), character.weights)
    weights[weights.sum(axis=1) == 0, 0] = 1
    return Skin(character.vertices, character.triangles, bones, weights,
                *_bind_poses(doll, character, bones, links), character.appearance, links=links)


def _read_cached(path: str, scale: float | None = None) -> Character:
    """Read a character, cached by path and modification time, for dolls that are being edited."""
    try:
        stat = os.stat(path)
    except (OSError, ValueError):
        # read_character raises the error with its reason.
        return read_character(path, scale)
    return _read_unchanged(path, scale, (stat.st_mtime_ns, stat.st_size))


@functools.lru_cache(maxsize=4)
def _read_unchanged(path: str, scale: float | None, _: tuple[int, int]) -> Character:
    return read_character(path, scale)


def _own_character(doll: Ragdoll, character: Character) -> Character:
    """The character of the file whose bones are the doll's riders.

    Raises UnknownBone where other bones move its skin too, or where it has no skin.
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
    return subset_character(character, own)


def _bind_poses(doll: Ragdoll, character: Character, bones: np.ndarray,
                links: np.ndarray) -> Pose:
    """Bind poses (n,) of bodies, and then of links, from the character's bones on the bodies."""
    index_of = {name: k for k, name in enumerate(character.bone_names)}
    riders = {rider.bone: rider for rider in reversed(doll.riders) if rider.name in index_of}
    riders.update({rider.bone: rider for rider in doll.riders if rider.name == rider.bone})
    mounted = mount_swings(Scene('bind', (Placement(doll),)))
    rests = [(mount.bone, root) for mount in mounted for root in mount.link_roots]
    carriers = np.array([*bones, *(rests[link][0] for link in links)], int)
    attached = [riders[doll.bones[index].name] for index in carriers]
    back = rotation.inverse(np.array([rider.orientation for rider in attached]))
    at = [index_of[rider.name] for rider in attached]
    orientations = rotation.multiply(character.orientations[at], back)
    local = np.array([rider.position for rider in attached])
    positions = character.positions[at] - rotation.rotate(orientations, local)
    if len(links):
        roots = np.concatenate([np.zeros((len(bones), 3)), [rests[link][1] for link in links]])
        positions = positions + rotation.rotate(orientations, roots)
    return Pose(positions, orientations)


def _scale_ratio(doll: Ragdoll, character: Character) -> float:
    """Median ratio of the lengths of the doll's rider bones to the character's.

    Of lengths, not of distances in space: the limbs of the doll may have been moved.
    """
    poses = State(np.array([bone.position for bone in doll.bones]),
                  np.array([bone.orientation for bone in doll.bones]),
                  *np.zeros((2, len(doll.bones), 3)))
    positions, _ = Riders(Scene('bind', (Placement(doll),))).poses(poses)
    index_of = {rider.name: k for k, rider in enumerate(doll.riders)}
    edges = np.array([(index_of[name], index_of[character.bone_names[up]], bone, up)
                      for bone, (name, up) in enumerate(zip(
                          character.bone_names, character.parents, strict=True))
                      if up >= 0 and name in index_of and character.bone_names[up] in index_of])
    if not len(edges):
        return 1.0
    ours = np.linalg.norm(positions[edges[:, 0]] - positions[edges[:, 1]], axis=1)
    theirs = np.linalg.norm(character.positions[edges[:, 2]] - character.positions[edges[:, 3]],
                            axis=1)
    some = theirs > 1e-3 * theirs.max()
    return float(np.median(ours[some] / theirs[some])) if some.any() else 1.0
