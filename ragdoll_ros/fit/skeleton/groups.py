"""Which bones of a skeleton become one rigid body: small ones are merged into their parents.

The parents are those that the skin shows (see skin_tree.py), from the trunk on.

The vertices that a bone moves are its cluster. A group is the bones that become one body, with
their clusters.
"""
from __future__ import annotations

import itertools
from dataclasses import dataclass, field

import numpy as np

from ..reading.character import Character
from ..roles.names import LIMBS, side_of
from ..shapes.axes import spread
from .skin_forest import PAIRED
from .skin_tree import SkinTree

SMALLEST = 0.055
"""A cluster shorter than this share of the whole character gets no body of its own."""

FEWEST = 4
"""Vertices of a cluster that has a size."""


@dataclass
class Group:
    """Bones that become one body; all by their index in the character."""

    bone: int
    """The one next to the parent's body; the root group's: the one with most skin."""
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
    anchors: list[np.ndarray] = field(default_factory=list)
    """Points (3,) m at which its joint may be, best first; of the root, its bone's."""
    anchor: np.ndarray = field(default_factory=lambda: np.zeros(3))
    """The one of them that is taken."""


def vertices_by_bone(character: Character, share: float | None = None,
                     swinging: frozenset[int] = frozenset()) -> list[np.ndarray]:
    """Cluster of each bone: indices (p,) of the vertices that it moves most.

    With a ``share``: of all that it moves by at least this skin weight, 0 to 1. A bone that is
    ``swinging`` has none.
    """
    return without(_clusters(character, share), swinging)


def without(clusters: list[np.ndarray], bones: frozenset[int]) -> list[np.ndarray]:
    """The clusters, those of some bones empty."""
    return [np.zeros(0, np.int64) if bone in bones else cluster
            for bone, cluster in enumerate(clusters)]


def _clusters(character: Character, share: float | None) -> list[np.ndarray]:
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
                tree: SkinTree, smallest: float | None = None,
                swinging: frozenset[int] = frozenset(),
                kept: frozenset[int] = frozenset()) -> list[Group]:
    """Groups of a character's bones, parents first.

    ``roles`` and ``clusters`` are each bone's, and parents are those of ``tree``. A bone whose
    cluster is shorter than ``smallest`` m (None: SMALLEST of the character) goes into its parent's
    group; so do a further piece of a limb or of the pelvis, a finger (unless ``smallest`` is 0),
    and a bone that is ``swinging``, which does so without its cluster. None that is ``kept`` does.
    """
    clusters = without(clusters, swinging)
    fingers = smallest == 0
    smallest = SMALLEST * character.extent if smallest is None else smallest
    merging = _Merging(character, clusters, tree.parents)
    depths = [len(merging.lineage(bone)) for bone in range(len(clusters))]
    for depth in range(max(depths), 1, -1):
        level = [bone for bone, own in enumerate(depths) if own == depth]
        sizes = {bone: merging.size(bone) for bone in level}
        for bone in (bone for bone in level if bone not in kept):
            parent = tree.parents[bone]
            paired = max(sizes[bone], sizes[_partner(character, bone, level)])
            if (bone in swinging or bone in tree.halves or paired == 0 or paired < smallest
                    or _one_body(character, roles, parent, bone, fingers)):
                merging.merge(bone, parent)
    merging.fill_root(smallest)
    heads = sorted(merging.heads, key=lambda bone: (len(merging.lineage(bone)), bone))
    groups = [merging.groups[bone] for bone in heads]
    # Without a joint, the root may as well be called by the bone that gave it its skin.
    groups[0].bone = max(groups[0].bones, key=lambda bone: len(clusters[bone]))
    for head, group in zip(heads, groups, strict=True):
        above = merging.parent(head)
        group.parent = heads.index(above) if above >= 0 else -1
        group.name, group.role = character.bone_names[group.bone], roles[group.bone]
        group.tied = head in tree.tied
        group.anchors = tree.anchors.get(head, [character.positions[group.bone]])
        group.anchor = group.anchors[0]
    return groups


class _Merging:
    """Groups in the making: at first each bone is one; ``heads`` are the topmost bones of each."""

    def __init__(self, character: Character, clusters: list[np.ndarray],
                 parents: tuple[int, ...]) -> None:
        self.groups = [Group(bone, [bone], cluster) for bone, cluster in enumerate(clusters)]
        self._character, self._above = character, parents
        self._into = list(range(len(clusters)))

    @property
    def heads(self) -> list[int]:
        return [bone for bone, into in enumerate(self._into) if into == bone]

    def size(self, bone: int) -> float:
        return cluster_size(self._character, self.groups[bone].vertices)

    def parent(self, bone: int) -> int:
        """Head of the group above the bone's, -1 if there is none."""
        bone = self._above[bone]
        while bone >= 0 and self._into[bone] != bone:
            bone = self._into[bone]
        return bone

    def lineage(self, bone: int) -> list[int]:
        """The head ``bone``, then those of the groups above it up to the root."""
        line = [bone]
        while (bone := self.parent(bone)) >= 0:
            line.append(bone)
        return line

    def merge(self, bone: int, target: int) -> None:
        group, other = self.groups[target], self.groups[bone]
        group.bones += other.bones
        group.vertices = np.union1d(group.vertices, other.vertices)
        self._into[bone] = target

    def fill_root(self, smallest: float) -> None:
        """Let a root without a body of its own take in its largest child."""
        root = self._above.index(-1)
        while self.size(root) < smallest:
            below = [bone for bone in self.heads if self.parent(bone) == root]
            if not below:
                break
            self.merge(max(below, key=self.size), root)


def cluster_size(character: Character, vertices: np.ndarray) -> float:
    """Longest edge of a cluster's box along its principal axes, m, without stray vertices."""
    if len(vertices) < FEWEST:
        return 0.0
    points = character.vertices[vertices]
    low, high = np.quantile(points @ spread(points, np.ones(len(points)))[1], [0.01, 0.99], axis=0)
    return float((high - low).max())


def _one_body(character: Character, roles: tuple[str | None, ...], parent: int, bone: int,
              fingers: bool) -> bool:
    """Whether both are pieces of one limb, of the pelvis, or of a hand without ``fingers``."""
    above, role = roles[parent], roles[bone]
    if role == 'hips' and side_of(character.bone_names[bone]):
        return above in ('hips', 'spine')
    return (role == above and role in LIMBS) or (
        role == 'finger' and above in ('hand', 'finger') and not fingers)


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
