"""Several characters in one file: which bones belong to which, the frame of each, subsets."""
from dataclasses import replace

import numpy as np

from ...model import rotation
from ...model.pose import Pose
from ..reading.character import Character, yaw_to_front
from .groups import vertices_by_bone
from .skin_adjacency import cluster_distances, find_adjacency

MIN_SEPARATION = 0.1
"""Distance between characters, as a fraction of the largest one's extent."""

MIN_CHARACTER_AREA = 0.4
"""Fraction of the largest character's skin area above which a detached part is a character."""


def split_characters(character: Character) -> list[tuple[Character, Pose]]:
    """The separate characters of a file, in its order, each with its frame's pose in the file's.

    Bones of one tree of the file, and bones that move skin together, belong to one character. A
    single character keeps the file's frame. Several are named after the file and numbered; the
    frame of each is at the median of its bones, on the file's ground, and faces as it does.
    """
    islands = _connected_components(character)
    if not islands.any() or not character.weights.any():
        return [(character, Pose())]
    owners = _assign_characters(character, islands)
    order = list(dict.fromkeys(owners.tolist()))
    if len(order) == 1:
        return [(character, Pose())]
    found = []
    for number, owner in enumerate(order, 1):
        part = subset_character(character, owners == owner)
        yaw = np.radians(yaw_to_front(part.bone_names, part.positions))
        frame = Pose(np.median(part.positions, axis=0) * (1, 1, 0),
                     rotation.from_axis_angle((0, 0, 1), -yaw))
        found.append((replace(to_frame(part, frame), name=f'{character.name}_{number}'), frame))
    return found


def _assign_characters(character: Character, islands: np.ndarray) -> np.ndarray:
    """Component (n,) that is the character of each bone.

    The largest component is a character, and so is each large one at a distance from all larger
    ones; every other component belongs to the nearest character.
    """
    clusters = vertices_by_bone(character)
    vertex_areas = character.vertex_areas()
    areas = np.bincount(islands, [vertex_areas[cluster].sum() for cluster in clusters])
    gaps = cluster_distances(character, clusters)
    order = [int(island) for island in np.argsort(-areas, kind='stable') if island in islands]
    first = order[0]
    own = np.concatenate([clusters[bone] for bone in np.flatnonzero(islands == first)])
    extent = float(np.ptp(character.vertices[own], axis=0).max())
    owner = {first: first}
    for island in order[1:]:
        distances = {whole: float(gaps[np.ix_(islands == island, islands == whole)].min())
                     for whole in set(owner.values())}
        nearest = min(distances, key=lambda whole: (distances[whole], whole != first))
        alone = (areas[island] > MIN_CHARACTER_AREA * areas[first]
                 and distances[nearest] > MIN_SEPARATION * extent)
        owner[island] = island if alone else nearest
    return np.array([owner[island] for island in islands])


def _connected_components(character: Character) -> np.ndarray:
    """Label (n,) of each bone's component, connected by the file's tree or by skin; all 0 if there
    is only one.
    """
    found = np.arange(len(character.parents))
    pairs = [*((bone, up) for bone, up in enumerate(character.parents) if up >= 0),
             *np.argwhere(find_adjacency(character).shared_area > 0)]
    for a, b in pairs:
        if found[a] != found[b]:
            found[found == max(found[a], found[b])] = min(found[a], found[b])
    return found


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
                            bones=tuple(int(place[bone]) for bone in spring.bones if own[bone]),
                            links=tuple(link for bone, link in zip(spring.bones, spring.links,
                                                                   strict=True) if own[bone]),
                            colliders=tuple(replace(each, bone=int(place[each.bone]))
                                            for each in spring.colliders if own[each.bone]))
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
        springs=tuple(replace(spring, points=frame.apply_inverse(spring.points), colliders=tuple(
            replace(each, axis=frame.apply_inverse(each.axis)) for each in spring.colliders))
            for spring in character.springs))
