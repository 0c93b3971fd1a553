"""Several characters in one file: which bones belong to which, and the frame of each."""
from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...model import rotation
from ...model.pose import Pose
from ..reading.character import Character, yaw_to_front
from ..reading.subset import subset_character, to_frame
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
    frame of each is at its centre, on the file's ground, and faces as the character does.
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
        frame = _character_frame(part)
        found.append((replace(to_frame(part, frame), name=f'{character.name}_{number}'), frame))
    return found


def _character_frame(character: Character) -> Pose:
    """Frame at the median of a character's bones, at height 0, that faces as the character does."""
    median = np.median(character.positions, axis=0) * (1, 1, 0)
    yaw = np.radians(yaw_to_front(character.bone_names, character.positions))
    return Pose(median, rotation.from_axis_angle((0, 0, 1), -yaw))


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
    """Label (n,) of each bone's component, connected by the file's tree or by skin; 0 if one."""
    found = np.arange(len(character.parents))
    pairs = [*((bone, up) for bone, up in enumerate(character.parents) if up >= 0),
             *np.argwhere(find_adjacency(character).shared_area > 0)]
    for a, b in pairs:
        if found[a] != found[b]:
            found[found == max(found[a], found[b])] = min(found[a], found[b])
    return found
