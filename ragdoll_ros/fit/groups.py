"""Which bones of a skeleton become one rigid body: small ones are merged into their parents.

The vertices that a bone moves are its cluster. A group is the bones that become one body, with
their clusters.
"""
from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from .axes import spread
from .character import Character
from .names import LIMBS

SMALLEST = 0.055
"""A cluster shorter than this share of the whole character gets no body of its own."""

FEWEST = 4
"""Vertices of a cluster that has a size."""

PAIRED = 0.02
"""Two bones are a left and a right one if one mirrored is this near to the other, of the whole."""


@dataclass
class Group:
    """Bones that become one body; all by their index in the character."""

    bone: int
    """The topmost, at whose root the body's joint is; the root group's: the one with most skin."""
    bones: list[int]
    """All of them."""
    vertices: np.ndarray
    """(p,) of their clusters."""
    parent: int = -1
    """Index of the parent's group, -1 for the root."""
    name: str = ''
    """Of ``bone``, and so of the body."""
    role: str | None = None
    """Of ``bone``; see roles_of."""
    tied: bool = False
    """Whether no bone joins it to its parent, so that it is tied to it rigidly."""


def vertices_by_bone(character: Character, share: float | None = None) -> list[np.ndarray]:
    """Cluster of each bone: indices (p,) of the vertices that it moves most.

    With a ``share``: of all that it moves by at least this skin weight, 0 to 1.
    """
    count = len(character.bone_names)
    same = character.bones[:, :, None] == character.bones[:, None, :]
    totals = np.einsum('vij,vj->vi', same, character.weights)
    if share is not None:
        row, slot = np.nonzero((totals >= share) & (totals > 0))
        bone = character.bones[row, slot]
        return [np.unique(row[bone == number]) for number in range(count)]
    # Of equal weights the first bone's counts, in whatever order the file has them.
    heaviest = totals >= totals.max(axis=1, keepdims=True) - 1e-6
    owner = np.where(heaviest, character.bones, count).min(axis=1)
    owner[totals.max(axis=1) <= 0] = -1
    order = np.argsort(owner, kind='stable')
    edges = np.searchsorted(owner[order], np.arange(count + 1))
    return [order[a:b] for a, b in itertools.pairwise(edges)]


def group_bones(character: Character, roles: tuple[str | None, ...], clusters: list[np.ndarray],
                smallest: float | None = None,
                swinging: frozenset[int] = frozenset()) -> list[Group]:
    """Groups of a character's bones, parents first.

    ``roles`` and ``clusters`` are each bone's. A bone whose cluster is shorter than ``smallest``
    m (None: SMALLEST of the character) goes into its parent's group; so do a further piece of a
    limb, a finger, and a bone that is ``swinging``, which does so without its cluster.
    """
    clusters = [np.zeros(0, np.int64) if bone in swinging else cluster
                for bone, cluster in enumerate(clusters)]
    smallest = SMALLEST * character.extent if smallest is None else smallest
    held = [Group(bone, [bone], cluster) for bone, cluster in enumerate(clusters)]
    parents = character.parents
    into = list(range(len(held)))
    for level in reversed(_levels(parents)):
        sizes = {bone: cluster_size(character, held[bone].vertices) for bone in level}
        for bone in level:
            parent = parents[bone]
            paired = max(sizes[bone], sizes[_partner(character, bone, level)])
            small = bone in swinging or paired < smallest
            if parent >= 0 and (small or _one_limb(roles[parent], roles[bone])):
                _absorb(held[parent], held[bone])
                into[bone] = parent
    heads = [bone for bone in range(len(held)) if into[bone] == bone]
    above = {bone: _head_above(bone, parents, into) for bone in heads}
    _settle_roots(character, held, heads, above, smallest)
    place = {bone: index for index, bone in enumerate(heads)}
    for bone in heads:
        held[bone].parent = place.get(above[bone], -1)
    root = held[heads[0]]
    # Without a joint, the root may as well be called by the bone that gave it its skin.
    root.bone = max(root.bones, key=lambda bone: len(clusters[bone]))
    groups = [held[bone] for bone in heads]
    for group in groups:
        group.name, group.role = character.bone_names[group.bone], roles[group.bone]
    return groups


def cluster_size(character: Character, vertices: np.ndarray) -> float:
    """Longest edge of a cluster's box along its principal axes, m, without stray vertices."""
    if len(vertices) < FEWEST:
        return 0.0
    points = character.vertices[vertices]
    low, high = np.quantile(points @ spread(points, np.ones(len(points)))[1], [0.01, 0.99], axis=0)
    return float((high - low).max())


def _one_limb(above: str | None, role: str | None) -> bool:
    return (role == above and role in LIMBS) or (role == 'finger' and above in ('hand', 'finger'))


def _levels(parents: tuple[int, ...]) -> list[list[int]]:
    depth: list[int] = []
    for parent in parents:
        depth.append(depth[parent] + 1 if parent >= 0 else 0)
    levels: list[list[int]] = [[] for _ in range(max(depth) + 1)]
    for bone, level in enumerate(depth):
        levels[level].append(bone)
    return levels


def _partner(character: Character, bone: int, level: list[int]) -> int:
    """The bone on the other side, so that both sides have the same bodies; else the bone."""
    mirrored = character.positions[bone] * (1, -1, 1)
    distances = np.linalg.norm(character.positions[level] - mirrored, axis=1)
    nearest = int(np.argmin(distances))
    return level[nearest] if distances[nearest] < PAIRED * character.extent else bone


def partner(character: Character, groups: list[Group], index: int) -> int:
    """Index of the group on the other side, or of this one where there is none."""
    heads = [group.bone for group in groups]
    other = heads.index(_partner(character, heads[index], heads))
    back = heads.index(_partner(character, heads[other], heads))
    return other if back == index else index


def _absorb(group: Group, other: Group) -> None:
    group.bones += other.bones
    group.vertices = np.union1d(group.vertices, other.vertices)


def _head_above(bone: int, parents: tuple[int, ...], into: list[int]) -> int:
    parent = parents[bone]
    while parent >= 0 and into[parent] != parent:
        parent = into[parent]
    return parent


def _settle_roots(character: Character, held: list[Group], heads: list[int],
                  above: dict[int, int], smallest: float) -> None:
    """Leave one root, and one with a body: a small root takes in its largest child.

    A bone without a parent that is not the root (a file may hold several skeletons) is tied to
    the root, or merged into it where it is small.
    """
    def size(bone: int) -> float:
        return cluster_size(character, held[bone].vertices)

    def merge(bone: int, target: int) -> None:
        _absorb(held[target], held[bone])
        heads.remove(bone)
        for other in heads:
            if above[other] == bone:
                above[other] = target

    for root in [bone for bone in heads if above[bone] < 0]:
        while size(root) < smallest:
            below = [bone for bone in heads if above[bone] == root]
            if not below:
                break
            merge(max(below, key=size), root)
    roots = [bone for bone in heads if above[bone] < 0]
    first = max(roots, key=lambda bone: _skin_below(held, heads, above, bone))
    for root in roots:
        if root == first:
            continue
        if size(root) < smallest:
            merge(root, first)
        else:
            above[root], held[root].tied = first, True
    heads.sort(key=lambda bone: (_depth(bone, above), bone))


def _skin_below(held: list[Group], heads: list[int], above: dict[int, int], root: int) -> int:
    total = 0
    for bone in heads:
        top = bone
        while above[top] >= 0:
            top = above[top]
        total += len(held[bone].vertices) * (top == root)
    return total


def _depth(bone: int, above: dict[int, int]) -> int:
    depth = 0
    while above[bone] >= 0:
        bone, depth = above[bone], depth + 1
    return depth
