"""Some of a character's bones as a character of their own, in a frame of its own."""
from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...model import rotation
from ...model.pose import Pose
from .character import Character


def part_of(character: Character, own: np.ndarray) -> Character:
    """The character of those bones, (n,) bool, that are its ``own``.

    It has every vertex that any of them moves, and the springs that hang from them; skin that no
    bone moves goes with the first bone.
    """
    if own.all():
        return character
    place = np.cumsum(own) - 1
    theirs = own[character.bones] & (character.weights > 0)
    moved = character.weights.any(axis=1)
    kept = np.where(moved, theirs.any(axis=1), own[0])
    triangles = kept[character.triangles].all(axis=1)
    seen = character.appearance
    appearance = seen and replace(seen, normals=seen.normals[kept], uvs=seen.uvs[kept],
                                  material_indices=seen.material_indices[triangles])
    chosen = np.flatnonzero(own)
    springs = tuple(replace(spring, carrier=int(place[spring.carrier]),
                            bones=tuple(int(place[bone]) for bone in spring.bones if own[bone]))
                    for spring in character.springs if own[spring.carrier])
    return replace(
        character, bone_names=tuple(character.bone_names[bone] for bone in chosen),
        parents=tuple(int(place[up]) if up >= 0 and own[up] else -1
                      for up in np.array(character.parents)[chosen]),
        positions=character.positions[own], orientations=character.orientations[own],
        vertices=character.vertices[kept],
        triangles=(np.cumsum(kept) - 1)[character.triangles[triangles]],
        bones=np.where(theirs, place[character.bones], 0)[kept],
        weights=np.where(theirs, character.weights, 0.0)[kept], springs=springs,
        appearance=appearance)


def seen_from(character: Character, frame: Pose) -> Character:
    """The character in another frame, which stands at ``frame`` in its own; z of both is up."""
    back = rotation.inverse(frame.orientation)
    appearance = character.appearance and replace(
        character.appearance, normals=rotation.rotate(back, character.appearance.normals))
    return replace(
        character, positions=frame.apply_inverse(character.positions),
        orientations=rotation.multiply(back, character.orientations),
        vertices=frame.apply_inverse(character.vertices), appearance=appearance,
        springs=tuple(replace(spring, points=frame.apply_inverse(spring.points))
                      for spring in character.springs))
