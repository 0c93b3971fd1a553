"""Kinematic tree of a character: its file's where that is plausible, else from its skin.

Animation rigs parent feet and hands to the root or to nothing, have controls without skin, and may
start at any bone. The edges are those of skin_forest.py; the root is the bone of the trunk whose
branches have the most even skin areas.
"""
from dataclasses import dataclass

import numpy as np

from ...files.bone_names.names import side_of
from ...model import errors
from ..reading.character import Character
from .skin_adjacency import nearest_midpoint
from .skin_forest import SkinForest

TREES = ('auto', 'file', 'skin')
"""Whose edges a tree has: the file's where they can be, else the skin's; all of the file's; or the
skin's alone. Where neither connects two parts, the distance decides."""

ROOT_BONUS = 0.2
"""Advantage of the file's root and of hips in the choice of the root, as a fraction of the skin."""


@dataclass(frozen=True)
class SkinTree:
    """Kinematic tree of the n bones of a character, by index."""

    parents: tuple[int, ...]
    """-1 for the root only. A bone without skin has a skinned parent."""
    anchors: dict[int, list[np.ndarray]]
    """Candidate anchors (3,) m, best first, of each skinned bone but the root."""
    halves: frozenset[int]
    """Bones that form one body with their parent, the other half."""
    fixed: frozenset[int]
    """Bones that neither file nor skin connects to their parent."""

    @property
    def order(self) -> list[int]:
        """All bones, parents first."""
        order = [self.parents.index(-1)]
        for bone in order:
            order.extend(child for child, up in enumerate(self.parents) if up == bone)
        return order


def find_skin_tree(character: Character, clusters: list[np.ndarray],
                   roles: tuple[str | None, ...], source: str = 'auto',
                   root: str | None = None) -> SkinTree:
    """Tree of a character's bones; ``clusters`` and ``roles`` are indexed by bone.

    ``source``: one of TREES. ``root``: name of the root; None: see _find_root. Raises UnknownBone
    for a root that does not exist, WrongForm for one without skin.
    """
    if not any(len(cluster) for cluster in clusters):
        return SkinTree((-1, *(0 for _ in clusters[1:])), {}, frozenset(), frozenset())
    forest = SkinForest(character, clusters, roles)
    forest.join_halves()
    if source != 'skin':
        forest.join_file_edges(trusted=source == 'file')
    forest.join_shared_skin()
    forest.join_nearest()
    first = _find_root(forest, source) if root is None else _named_root(forest, root)
    parents, order = _parents_from(forest, first)
    fixed, halves = ({frozenset(edge) for edge in edges} for edges in (forest.fixed, forest.halves))
    edges = {bone: frozenset((bone, parents[bone])) for bone in order[1:]}
    anchors = {bone: _anchors(forest, bone, parents[bone]) for bone in order[1:]}
    for bone in set(range(len(clusters))) - set(order):
        parents[bone] = _skinned_bone_near(forest, bone, first)
    return SkinTree(tuple(parents), anchors,
                    frozenset(bone for bone, edge in edges.items() if edge in halves),
                    frozenset(bone for bone, edge in edges.items() if edge in fixed))


def _named_root(forest: SkinForest, name: str) -> int:
    names = forest.character.bone_names
    if name not in names:
        raise errors.UnknownBone('root', name, errors.one_of(names, name))
    bone = names.index(name)
    if bone not in forest.skinned:
        raise errors.WrongForm('root', name, 'a bone that moves skin')
    return bone


def _find_root(forest: SkinForest, source: str) -> int:
    """The bone whose largest branch is smallest, with ROOT_BONUS for the file's root and the hips.
    Bones on the mirror plane come first, except neck and head. For ``source`` 'file': the largest
    of the file's roots.
    """
    names, roles = forest.character.bone_names, forest.roles
    halves = {bone for pair in forest.halves for bone in pair}
    single = [bone for bone in forest.skinned if bone in halves or (
        forest.mirrored[bone] == bone and not side_of(names[bone]))]
    # However large: a figure may have most of its skin on the head.
    single = [bone for bone in single if roles[bone] not in ('neck', 'head')] or single
    tops = [bone for bone in forest.skinned if forest.skinned_parents[bone] < 0]
    first = max(tops, key=lambda bone: forest.areas[bone], default=-1)
    if source == 'file' and first >= 0:
        return first

    def imbalance(bone: int) -> float:
        trusted = bone == first or (roles[bone] == 'hips' and bone in single)
        return round(_largest_branch(forest, bone) - trusted * ROOT_BONUS, 9)

    return min(single or forest.skinned, key=lambda bone: (imbalance(bone), bone))


def _largest_branch(forest: SkinForest, root: int) -> float:
    """Fraction of all skin in the largest branch of a bone; its other half is no branch."""
    own = {root, *(bone for pair in forest.halves if root in pair for bone in pair)}
    parents, order = _parents_from(forest, root)
    subtree, largest = forest.areas.copy(), 0.0
    for bone in reversed(order):
        if bone in own:
            continue
        if parents[bone] in own:
            largest = max(largest, subtree[bone])
        else:
            subtree[parents[bone]] += subtree[bone]
    return float(largest / max(forest.areas.sum(), 1e-300))


def _parents_from(forest: SkinForest, root: int) -> tuple[list[int], list[int]]:
    """Parents of the skinned bones seen from a root, and their order; -1 for all others."""
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


def _skinned_bone_near(forest: SkinForest, bone: int, root: int) -> int:
    """The skinned bone that a bone without skin follows: its nearest ancestor, else descendant."""
    if forest.skinned_parents[bone] >= 0:
        return forest.skinned_parents[bone]
    level = [bone]
    while level:
        level = [child for child, up in enumerate(forest.character.parents) if up in level]
        for child in level:
            if len(forest.clusters[child]):
                return child
    return root


def _anchors(forest: SkinForest, bone: int, parent: int) -> list[np.ndarray]:
    """Candidate anchors (3,) m: the lower bone's root, then where the skins meet."""
    character = forest.character
    lower = parent if forest.skinned_parents[parent] == bone else bone
    points = [character.positions[lower]]
    centroid = forest.adjacency.centroid(bone, parent)
    if centroid is not None:
        points.append(centroid)
    return [*points, nearest_midpoint(character, forest.clusters[bone], forest.clusters[parent])]
