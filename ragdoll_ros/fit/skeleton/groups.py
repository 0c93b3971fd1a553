"""Group the bones of a skeleton into bodies: small bones are merged into their parents.

Parents are those of the skin tree (see skin_tree.py). The cluster of a bone is the set of vertices
that it moves; a group is the bones of one body with their clusters.
"""
import itertools
from dataclasses import dataclass, field

import numpy as np

from ...files.bone_names.names import SINGLE_ROLES, side_of
from ..reading.character import Character
from ..shapes.axes import principal_components
from .skin_forest import MIRROR_TOLERANCE
from .skin_tree import SkinTree

MIN_CLUSTER_SIZE = 0.055
"""Shortest cluster that gets a body, as a fraction of the character's extent."""

MIN_CLUSTER_VERTICES = 4
"""Fewest vertices of a cluster that gets a body."""


@dataclass
class BodyGroup:
    """Bones that become one body, by their indices in the character."""

    bone: int
    """Bone that names the body: the topmost; of the root group, the one with the most vertices."""
    bones: list[int]
    """All bones of the group."""
    vertices: np.ndarray
    """(p,) vertex indices of their clusters."""
    parent: int = -1
    """Index of the parent group, -1 for the root."""
    name: str = ''
    """Name of ``bone``, and so of the body."""
    role: str | None = None
    """Role of ``bone``; see roles_of."""
    fixed: bool = False
    """Whether neither skeleton nor skin connects it to its parent: the joint is fixed."""
    anchors: list[np.ndarray] = field(default_factory=list)
    """Candidate joint anchors (3,) m, best first; for the root, the root of its bone."""
    anchor: np.ndarray = field(default_factory=lambda: np.zeros(3))
    """The chosen candidate."""


def vertices_by_bone(character: Character, min_weight: float | None = None,
                     swinging: frozenset[int] = frozenset()) -> list[np.ndarray]:
    """Cluster of each bone: indices (p,) of the vertices for which it has the largest weight.

    With ``min_weight``, 0 to 1: of all vertices for which it has at least this skin weight. A
    ``swinging`` bone has an empty cluster.
    """
    return clear_clusters(_clusters(character, min_weight), swinging)


def clear_clusters(clusters: list[np.ndarray], bones: frozenset[int]) -> list[np.ndarray]:
    """The clusters, with those of some bones emptied."""
    return [np.zeros(0, np.int64) if bone in bones else cluster
            for bone, cluster in enumerate(clusters)]


def _clusters(character: Character, min_weight: float | None) -> list[np.ndarray]:
    count = len(character.bone_names)
    same = character.bones[:, :, None] == character.bones[:, None, :]
    totals = np.einsum('vij,vj->vi', same, character.weights)
    if min_weight is not None:
        row, slot = np.nonzero((totals >= min_weight) & (totals > 0))
        bone = character.bones[row, slot]
        return [np.unique(row[bone == number]) for number in range(count)]
    # Among equal weights the bone of lowest index, whatever the order in the file.
    heaviest = totals >= totals.max(axis=1, keepdims=True) - 1e-6
    owner = np.where(heaviest, character.bones, count).min(axis=1)
    owner[totals.max(axis=1) <= 0] = -1
    order = np.argsort(owner, kind='stable')
    edges = np.searchsorted(owner[order], np.arange(count + 1))
    return [order[a:b] for a, b in itertools.pairwise(edges)]


def group_bones(character: Character, roles: tuple[str | None, ...], clusters: list[np.ndarray],
                tree: SkinTree, smallest: float | None = None,
                swinging: frozenset[int] = frozenset(),
                forced: frozenset[int] = frozenset()) -> list[BodyGroup]:
    """Groups of a character's bones, parents first.

    ``roles`` and ``clusters`` are indexed by bone; parents are those of ``tree``. A bone whose
    cluster, with those merged into it, is shorter than ``smallest`` m on both sides (None:
    MIN_CLUSTER_SIZE of the character) is merged into its parent; so are a second bone of a limb
    segment or of the pelvis, a finger (unless ``smallest`` is 0), and a ``swinging`` bone, without
    its cluster. A ``forced`` bone is not.
    """
    clusters = clear_clusters(clusters, swinging)
    fingers = smallest == 0
    smallest = MIN_CLUSTER_SIZE * character.extent if smallest is None else smallest
    merger = _GroupMerger(character, clusters, tree.parents)
    depths = [len(merger.path_to_root(bone)) for bone in range(len(clusters))]
    for depth in range(max(depths), 1, -1):
        level = [bone for bone, own in enumerate(depths) if own == depth]
        sizes = {bone: merger.size(bone) for bone in level}
        for bone in (bone for bone in level if bone not in forced):
            parent = tree.parents[bone]
            paired = max(sizes[bone], sizes[_mirrored_bone(character, bone, level)])
            if (bone in swinging or bone in tree.halves or paired == 0 or paired < smallest
                    or _is_same_segment(character, roles, parent, bone, fingers)):
                merger.merge(bone, parent)
    merger.grow_root(smallest)
    heads = sorted(merger.heads, key=lambda bone: (len(merger.path_to_root(bone)), bone))
    groups = [merger.groups[bone] for bone in heads]
    # The root has no joint: it takes the name of the bone with the most vertices.
    groups[0].bone = max(groups[0].bones, key=lambda bone: len(clusters[bone]))
    for head, group in zip(heads, groups, strict=True):
        above = merger.parent(head)
        group.parent = heads.index(above) if above >= 0 else -1
        group.name, group.role = character.bone_names[group.bone], roles[group.bone]
        group.fixed = head in tree.fixed
        group.anchors = tree.anchors.get(head, [character.positions[group.bone]])
        group.anchor = group.anchors[0]
    return groups


class _GroupMerger:
    """Merging of groups, initially one for each bone; ``heads`` are their topmost bones."""

    def __init__(self, character: Character, clusters: list[np.ndarray],
                 parents: tuple[int, ...]) -> None:
        self.groups = [BodyGroup(bone, [bone], cluster) for bone, cluster in enumerate(clusters)]
        self._character, self._above = character, parents
        self._merged_into = list(range(len(clusters)))

    @property
    def heads(self) -> list[int]:
        return [bone for bone, into in enumerate(self._merged_into) if into == bone]

    def size(self, bone: int) -> float:
        return cluster_size(self._character, self.groups[bone].vertices)

    def parent(self, bone: int) -> int:
        """Head of the parent group of a bone, -1 if there is none."""
        bone = self._above[bone]
        while bone >= 0 and self._merged_into[bone] != bone:
            bone = self._merged_into[bone]
        return bone

    def path_to_root(self, bone: int) -> list[int]:
        """The head ``bone``, then the heads of its ancestors up to the root."""
        line = [bone]
        while (bone := self.parent(bone)) >= 0:
            line.append(bone)
        return line

    def merge(self, bone: int, target: int) -> None:
        group, other = self.groups[target], self.groups[bone]
        group.bones += other.bones
        group.vertices = np.union1d(group.vertices, other.vertices)
        self._merged_into[bone] = target

    def grow_root(self, smallest: float) -> None:
        """Merge the largest child into the root until the root is large enough for a body."""
        root = self._above.index(-1)
        while self.size(root) < smallest:
            below = [bone for bone in self.heads if self.parent(bone) == root]
            if not below:
                break
            self.merge(max(below, key=self.size), root)


def cluster_size(character: Character, vertices: np.ndarray) -> float:
    """Longest edge, m, of a cluster's box along its principal axes, without outliers."""
    if len(vertices) < MIN_CLUSTER_VERTICES:
        return 0.0
    points = character.vertices[vertices]
    _, axes = principal_components(points, np.ones(len(points)))
    low, high = np.quantile(points @ axes, [0.01, 0.99], axis=0)
    return float((high - low).max())


def _is_same_segment(character: Character, roles: tuple[str | None, ...], parent: int, bone: int,
                     fingers: bool) -> bool:
    """Whether both bones belong to one limb segment or pelvis or, unless ``fingers``, to
    one hand.
    """
    above, role = roles[parent], roles[bone]
    if role == 'hips' and side_of(character.bone_names[bone]):
        return above in ('hips', 'spine')
    return (role == above and role in SINGLE_ROLES) or (
        role == 'finger' and above in ('hand', 'finger') and not fingers)


def _mirrored_bone(character: Character, bone: int, level: list[int]) -> int:
    """The bone, among ``level``, at the mirrored position of a bone; else the bone itself."""
    mirrored = character.positions[bone] * (1, -1, 1)
    distances = np.linalg.norm(character.positions[level] - mirrored, axis=1)
    nearest = int(np.argmin(distances))
    return level[nearest] if distances[nearest] < MIRROR_TOLERANCE * character.extent else bone


def mirrored_group(character: Character, groups: list[BodyGroup], index: int) -> int:
    """Index of the group on the other side, or of this group where there is none."""
    heads = [group.bone for group in groups]
    other = heads.index(_mirrored_bone(character, heads[index], heads))
    back = heads.index(_mirrored_bone(character, heads[other], heads))
    return other if back == index else index
