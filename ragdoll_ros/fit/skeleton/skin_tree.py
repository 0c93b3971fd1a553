"""The skeleton that a skin shows, whatever the file's tree says: from the trunk to the limbs.

Rigs for animation hang feet and hands from the root or from nothing, have controls that move no
skin, and begin anywhere. The edges are those of skin_forest.py; the root is the bone in the middle.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..reading.character import Character
from ..roles.names import side_of
from .borders import nearest_points
from .skin_forest import SkinForest

TRUSTED = 0.2
"""So much more of the skin may hang on one side of the file's own root, or of hips."""


@dataclass(frozen=True)
class SkinTree:
    """How the n bones of a character hang together as bodies; bones by their index."""

    parents: tuple[int, ...]
    """-1 for the root alone. A bone without skin has a bone with skin for its parent."""
    anchors: dict[int, list[np.ndarray]]
    """Of each bone with skin but the root: points (3,) m at which it may be jointed, best first."""
    halves: frozenset[int]
    """Bones that are one body with their parent, the other half."""
    tied: frozenset[int]
    """Bones that neither the file nor the skin joins to their parent."""

    @property
    def order(self) -> list[int]:
        """All bones, parents first."""
        order = [self.parents.index(-1)]
        for bone in order:
            order.extend(child for child, up in enumerate(self.parents) if up == bone)
        return order


def find_skin_tree(character: Character, clusters: list[np.ndarray],
                   roles: tuple[str | None, ...]) -> SkinTree:
    """Tree of a character's bones; ``clusters`` and ``roles`` are each bone's."""
    if not any(len(cluster) for cluster in clusters):
        return SkinTree((-1, *(0 for _ in clusters[1:])), {}, frozenset(), frozenset())
    forest = SkinForest(character, clusters, roles)
    forest.join_halves()
    forest.join_as_the_file()
    forest.join_by_skin()
    forest.join_by_nearness()
    root = _find_root(forest)
    parents, order = _parents_from(forest, root)
    tied, halves = ({frozenset(edge) for edge in edges} for edges in (forest.tied, forest.halves))
    edges = {bone: frozenset((bone, parents[bone])) for bone in order[1:]}
    anchors = {bone: _anchors(forest, bone, parents[bone]) for bone in order[1:]}
    for bone in set(range(len(clusters))) - set(order):
        parents[bone] = _carrier(forest, bone, root)
    return SkinTree(tuple(parents), anchors,
                    frozenset(bone for bone, edge in edges.items() if edge in halves),
                    frozenset(bone for bone, edge in edges.items() if edge in tied))


def _find_root(forest: SkinForest) -> int:
    """The bone in the middle: the largest branch that hangs on it is as small as can be.

    Never one of two twins, if there is another.
    """
    names, roles = forest.character.bone_names, forest.roles
    halves = {bone for pair in forest.halves for bone in pair}
    single = [bone for bone in forest.skinned if bone in halves or (
        forest.twins[bone] == bone and not side_of(names[bone]))]
    tops = [bone for bone in forest.skinned if forest.above[bone] < 0]
    first = max(tops, key=lambda bone: forest.areas[bone], default=-1)

    def heaviest(bone: int) -> float:
        trusted = bone == first or (roles[bone] == 'hips' and bone in single)
        return round(_largest_branch(forest, bone) - trusted * TRUSTED, 9)

    return min(single or forest.skinned, key=lambda bone: (heaviest(bone), bone))


def _largest_branch(forest: SkinForest, root: int) -> float:
    """Share of all skin in the heaviest branch of a bone; its other half is none."""
    own = {root, *(bone for pair in forest.halves if root in pair for bone in pair)}
    parents, order = _parents_from(forest, root)
    carried, largest = forest.areas.copy(), 0.0
    for bone in reversed(order):
        if bone in own:
            continue
        if parents[bone] in own:
            largest = max(largest, carried[bone])
        else:
            carried[parents[bone]] += carried[bone]
    return float(largest / max(forest.areas.sum(), 1e-300))


def _parents_from(forest: SkinForest, root: int) -> tuple[list[int], list[int]]:
    """Parents of all bones with skin, as seen from a root, and their order; -1 for the others."""
    next_to: dict[int, list[int]] = {bone: [] for bone in forest.skinned}
    for a, b in forest.edges:
        if a in next_to and b in next_to:
            next_to[a].append(b)
            next_to[b].append(a)
    parents, order = [-1] * len(forest.clusters), [root]
    for bone in order:
        for other in next_to[bone]:
            if other != parents[bone]:
                parents[other] = bone
                order.append(other)
    return parents, order


def _carrier(forest: SkinForest, bone: int, root: int) -> int:
    """The bone with skin that a bone without follows: the next above, else below."""
    if forest.above[bone] >= 0:
        return forest.above[bone]
    level = [bone]
    while level:
        level = [child for child, up in enumerate(forest.character.parents) if up in level]
        for child in level:
            if len(forest.clusters[child]):
                return child
    return root


def _anchors(forest: SkinForest, bone: int, parent: int) -> list[np.ndarray]:
    """Points at which two bones may be jointed: the lower one's root, then where skins meet."""
    character = forest.character
    lower = parent if forest.above[parent] == bone else bone
    points = [character.positions[lower]]
    middle = forest.borders.middle(bone, parent)
    if middle is not None:
        points.append(middle)
    return [*points, nearest_points(character, forest.clusters[bone], forest.clusters[parent])]
