"""Several characters in one skin: the largest is fitted as if it were alone."""
from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..reading.character import Character
from .borders import find_borders, find_gaps
from .groups import vertices_by_bone

APART = 0.1
"""Large islands that are further apart than this, of the larger, are different characters."""

LARGE = 0.4
"""What has more than this share of the largest one's skin is no limb that the file forgot to
join."""


def largest_alone(character: Character) -> tuple[Character, list[str]]:
    """The character with the skin of the largest alone, and a note on each other that is apart.

    All bones stay: those of the others move no skin then, and go along with the root.
    """
    islands = _islands(character)
    if len(np.unique(islands)) == 1:
        return character, []
    clusters = vertices_by_bone(character, None, frozenset())
    vertex_areas = character.vertex_areas()
    areas = np.bincount(islands, [vertex_areas[cluster].sum() for cluster in clusters])
    gaps = find_gaps(character, clusters)
    first = int(areas.argmax())
    own = np.concatenate([clusters[bone] for bone in np.flatnonzero(islands == first)])
    extent = float(np.ptp(character.vertices[own], axis=0).max())

    def gap(island: int, other: int) -> float:
        return float(gaps[np.ix_(islands == island, islands == other)].min())

    others = [island for island in np.unique(islands) if areas[island] > LARGE * areas[first]
              and island != first and gap(island, first) > APART * extent]
    if not others:
        return character, []
    # What is small goes to the character that is nearest.
    owner = {island: island if island in (first, *others)
             else min((first, *others), key=lambda whole: gap(island, whole))
             for island in np.unique(islands)}
    owners = np.array([owner[island] for island in islands])
    notes = []
    for other in others:
        bones = [bone for bone in np.flatnonzero(owners == other) if len(clusters[bone])]
        notes.append(f'another character, of {len(bones)} bones from '
                     f'{character.bone_names[bones[0]]} on, is apart from this one: it gets no '
                     'bodies and goes along with the root; export each by itself')
    theirs = np.concatenate([clusters[bone] for bone in np.flatnonzero(owners != first)])
    return _without(character, theirs), notes


def _islands(character: Character) -> np.ndarray:
    """For each bone (n,) a number: the same for those of one tree of the file, or of one skin."""
    found = np.arange(len(character.parents))
    pairs = [*((bone, up) for bone, up in enumerate(character.parents) if up >= 0),
             *np.argwhere(find_borders(character).shared > 0)]
    for a, b in pairs:
        if found[a] != found[b]:
            found[found == found[a]] = found[b]
    return found


def _without(character: Character, vertices: np.ndarray) -> Character:
    """The character without these vertices and the triangles on them."""
    kept = np.ones(len(character.vertices), bool)
    kept[vertices] = False
    triangles = kept[character.triangles].all(axis=1)
    paint = character.paint and replace(
        character.paint, normals=character.paint.normals[kept], uvs=character.paint.uvs[kept],
        numbers=character.paint.numbers[triangles])
    return replace(character, vertices=character.vertices[kept], bones=character.bones[kept],
                   weights=character.weights[kept], paint=paint,
                   triangles=(np.cumsum(kept) - 1)[character.triangles[triangles]])
