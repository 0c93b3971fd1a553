"""Several characters in one file: which bones are whose, and where each stands."""
from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...model import rotation
from ...model.pose import Pose
from ..reading.character import Character, yaw_to_front
from ..reading.part import part_of, seen_from
from .borders import find_borders, find_gaps
from .groups import vertices_by_bone

APART = 0.1
"""Large islands that are further apart than this, of the largest, are different characters."""

LARGE = 0.4
"""What has more than this share of the largest one's skin is no limb that the file forgot to
join."""


def find_characters(character: Character) -> list[tuple[Character, Pose]]:
    """Each of the file's characters that stand apart, and where its frame stands in the file's.

    In the file's order; most files have one, which keeps the file's frame. Bones of one tree of the
    file, and bones that move skin together, are one character's. Of several, each is called as the
    file and numbered; its frame is in its middle and faces as it does.
    """
    islands = _islands(character)
    if not islands.any() or not character.weights.any():
        return [(character, Pose())]
    owners = _owners(character, islands)
    order = list(dict.fromkeys(owners.tolist()))
    if len(order) == 1:
        return [(character, Pose())]
    found = []
    for number, owner in enumerate(order, 1):
        part = part_of(character, owners == owner)
        frame = _own_frame(part)
        found.append((replace(seen_from(part, frame), name=f'{character.name}_{number}'), frame))
    return found


def _own_frame(character: Character) -> Pose:
    """A frame in the middle of a character's bones, on the file's ground, that faces as it does.

    Of one that is alike on both sides half of the other bones are on each side of the middle ones.
    """
    middle = np.median(character.positions, axis=0) * (1, 1, 0)
    yaw = np.radians(yaw_to_front(character.bone_names, character.positions))
    return Pose(middle, rotation.from_axis_angle((0, 0, 1), -yaw))


def _owners(character: Character, islands: np.ndarray) -> np.ndarray:
    """For each bone (n,) the island that is its character's.

    Characters are the largest island, and large ones apart from all larger ones; the rest goes to
    the nearest of these.
    """
    clusters = vertices_by_bone(character)
    vertex_areas = character.vertex_areas()
    areas = np.bincount(islands, [vertex_areas[cluster].sum() for cluster in clusters])
    gaps = find_gaps(character, clusters)
    order = [int(island) for island in np.argsort(-areas, kind='stable') if island in islands]
    first = order[0]
    own = np.concatenate([clusters[bone] for bone in np.flatnonzero(islands == first)])
    extent = float(np.ptp(character.vertices[own], axis=0).max())
    owner = {first: first}
    for island in order[1:]:
        distances = {whole: float(gaps[np.ix_(islands == island, islands == whole)].min())
                     for whole in set(owner.values())}
        nearest = min(distances, key=lambda whole: (distances[whole], whole != first))
        alone = areas[island] > LARGE * areas[first] and distances[nearest] > APART * extent
        owner[island] = island if alone else nearest
    return np.array([owner[island] for island in islands])


def _islands(character: Character) -> np.ndarray:
    """For each bone (n,) a number: the same for those of one tree of the file, or of one skin.

    All are zero where there is one island.
    """
    found = np.arange(len(character.parents))
    pairs = [*((bone, up) for bone, up in enumerate(character.parents) if up >= 0),
             *np.argwhere(find_borders(character).shared > 0)]
    for a, b in pairs:
        if found[a] != found[b]:
            found[found == max(found[a], found[b])] = min(found[a], found[b])
    return found
