"""A subset of a character's bones as a character of its own, and changes of its frame."""
from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...model import rotation
from ...model.pose import Pose
from .character import Character


def subset_character(character: Character, own: np.ndarray) -> Character:
    """The character of those bones that the mask ``own`` (n,) selects.

    It has all vertices that any of them moves, and the spring bones attached to them; unweighted
    vertices belong to the first bone of the file.
    """
    if own.all():
        return character
    place = np.cumsum(own) - 1
    theirs = own[character.bones] & (character.weights > 0)
    moved = character.weights.any(axis=1)
    used = np.where(moved, theirs.any(axis=1), own[0])
    triangles = used[character.triangles].all(axis=1)
    look = character.appearance
    appearance = look and replace(look, normals=look.normals[used], uvs=look.uvs[used],
                                  material_indices=look.material_indices[triangles])
    chosen = np.flatnonzero(own)
    springs = tuple(replace(spring, carrier=int(place[spring.carrier]),
                            bones=tuple(int(place[bone]) for bone in spring.bones if own[bone]))
                    for spring in character.springs if own[spring.carrier])
    return replace(
        character, bone_names=tuple(character.bone_names[bone] for bone in chosen),
        parents=tuple(int(place[up]) if up >= 0 and own[up] else -1
                      for up in np.array(character.parents)[chosen]),
        positions=character.positions[own], orientations=character.orientations[own],
        vertices=character.vertices[used],
        triangles=(np.cumsum(used) - 1)[character.triangles[triangles]],
        bones=np.where(theirs, place[character.bones], 0)[used],
        weights=np.where(theirs, character.weights, 0.0)[used], springs=springs,
        appearance=appearance)


def to_frame(character: Character, frame: Pose) -> Character:
    """The character in another frame, whose pose in the current one is ``frame``; z stays up."""
    back = rotation.inverse(frame.orientation)
    appearance = character.appearance and replace(
        character.appearance, normals=rotation.rotate(back, character.appearance.normals))
    return replace(
        character, positions=frame.apply_inverse(character.positions),
        orientations=rotation.multiply(back, character.orientations),
        vertices=frame.apply_inverse(character.vertices), appearance=appearance,
        springs=tuple(replace(spring, points=frame.apply_inverse(spring.points))
                      for spring in character.springs))
