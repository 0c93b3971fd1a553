"""The skeleton that a skin shows, whatever the file's tree says.

Rigs for animation hang feet and hands from the root or from nothing, and have controls that move
no skin. Bones are neighbours where their skins meet: the file's own edges come first where the skin
agrees, then what shares most skin, then what is nearest.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .borders import Borders, find_borders, find_gaps, nearest_points
from .character import Character
from .names import LIMBS, side_of

AGREES = 0.1
"""The skin agrees with the file where bone and parent share this much of the most that the bone
shares with any."""

NOISE = 0.003
"""Skin shared by less than this share of the smaller bone's is a stray weight."""

TOUCHING = 0.03
"""Skins this near to each other, of the whole character, may be jointed."""

HALVES = 0.25
"""A left and a right bone are halves of one body if this share of their borders is common."""

PAIRED = 0.02
"""Left and right mirror each other to this share of the whole."""

TRUSTED = 0.2
"""So much more of the skin may hang on one side of the file's own root, or of hips."""

LARGEST_TIED = 0.3
"""What is of another skeleton and has more than this share of the skin is tied, not jointed."""


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
    growing = _Growing(character, clusters, roles)
    growing.join_halves()
    growing.join_as_the_file()
    growing.join_by_skin()
    growing.join_by_nearness()
    return growing.rooted()


class _Growing:
    """A forest of bones with skin that grows together, edge by edge, until it is one tree."""

    def __init__(self, character: Character, clusters: list[np.ndarray],
                 roles: tuple[str | None, ...]) -> None:
        self.character, self.clusters, self.roles = character, clusters, roles
        areas = character.vertex_areas()
        self.areas = np.array([areas[cluster].sum() for cluster in clusters])
        self.skinned = [bone for bone, cluster in enumerate(clusters) if len(cluster)]
        self.above = [self._skinned_above(bone) for bone in range(len(clusters))]
        self.twins = self._find_twins()
        self.borders: Borders = find_borders(character)
        # As much on both sides, so that left and right are joined alike.
        shared = self.borders.shared
        self.shared = shared + shared[np.ix_(self.twins, self.twins)]
        self.edges: list[tuple[int, int]] = []
        self.halves: list[tuple[int, int]] = []
        self.tied: list[tuple[int, int]] = []
        self._tree_of = np.arange(len(clusters))

    def join_halves(self) -> None:
        """Left and right that meet in the middle over much of their border are one body.

        So are halves of a pelvis by their names.
        """
        for bone in self.skinned:
            twin = int(self.twins[bone])
            total = self.shared[bone].sum()
            if bone < twin and (self._is_pelvis(bone) or (
                    self.roles[bone] not in LIMBS
                    and self.shared[bone, twin] > HALVES * total > 0)):
                self._join(bone, twin)
                self.halves.append((bone, twin))

    def join_as_the_file(self) -> None:
        """Bones whose skin meets their parent's in the file."""
        for bone in self.skinned:
            parent = self.above[bone]
            if parent >= 0 and self.twins[bone] != parent and (
                    self.shared[bone, parent] > AGREES * self.shared[bone].max() > 0):
                self._join(bone, parent)

    def join_by_skin(self) -> None:
        """Bones that share skin, those that share most first."""
        least = NOISE * np.minimum(self.areas[:, None], self.areas)
        pairs = [(a, b) for a, b in np.argwhere(np.triu(self.shared > least))
                 if self.twins[a] != b and len(self.clusters[a]) and len(self.clusters[b])]
        for a, b in sorted(pairs, key=lambda pair: -self.shared[pair]):
            self._join(int(a), int(b))

    def join_by_nearness(self) -> None:
        """Islands of skin: as the file has them where that is near, else where they are nearest."""
        if len(self._trees()) == 1:
            return
        gaps = find_gaps(self.character, self.clusters)
        near = TOUCHING * self.character.extent
        file = {(bone, self.above[bone]) for bone in self.skinned if self.above[bone] >= 0}
        # Twins are jointed to each other only where there is nothing else.
        gaps[self.skinned, self.twins[self.skinned]] += self.character.extent
        while len(trees := self._trees()) > 1:
            island = min(trees, key=lambda tree: self.areas[self._tree_of == tree].sum())
            inner = np.flatnonzero(self._tree_of == island)
            inner = inner[[len(self.clusters[bone]) > 0 for bone in inner]]
            outer = np.array([bone for bone in self.skinned if self._tree_of[bone] != island])
            between = gaps[np.ix_(inner, outer)]
            row, column = np.unravel_index(np.argmin(between), between.shape)
            edge = int(inner[row]), int(outer[column])
            known = [(a, b) for a, b in file if self._tree_of[a] != self._tree_of[b]
                     and island in (self._tree_of[a], self._tree_of[b])]
            kept = min(known, key=lambda pair: (gaps[pair], pair), default=None)
            if kept and (gaps[kept] <= between.min() + near or between.min() > near):
                edge = kept
            share = self.areas[inner].sum() / self.areas.sum()
            strange = not kept and self._file_root(edge[0]) != self._file_root(edge[1])
            if strange and (between.min() > near or share > LARGEST_TIED):
                # By its own root, as nothing is known of where it might turn.
                top = next(bone for bone in inner if self.above[bone] not in inner)
                edge = int(top), int(outer[np.argmin(gaps[top, outer])])
                self.tied.append(edge)
            self._join(*edge)

    def rooted(self) -> SkinTree:
        """The tree from its root on."""
        root = self._find_root()
        parents = self._parents_from(root)
        tied = {frozenset(edge) for edge in self.tied}
        halves = {frozenset(edge) for edge in self.halves}
        below = [(bone, parents[bone]) for bone in self.skinned if bone != root]
        for bone, parent in enumerate(parents):
            if parent < 0 and bone != root:
                parents[bone] = self._carrier(bone, root)
        return SkinTree(
            tuple(parents), {bone: self._anchors(bone, parent) for bone, parent in below},
            frozenset(bone for bone, parent in below if {bone, parent} in halves),
            frozenset(bone for bone, parent in below if {bone, parent} in tied))

    def _join(self, a: int, b: int) -> None:
        if self._tree_of[a] != self._tree_of[b]:
            self.edges.append((a, b))
            self._tree_of[self._tree_of == self._tree_of[b]] = self._tree_of[a]

    def _trees(self) -> list[int]:
        return sorted({int(self._tree_of[bone]) for bone in self.skinned})

    def _skinned_above(self, bone: int) -> int:
        bone = self.character.parents[bone]
        while bone >= 0 and not len(self.clusters[bone]):
            bone = self.character.parents[bone]
        return bone

    def _file_root(self, bone: int) -> int:
        while self.character.parents[bone] >= 0:
            bone = self.character.parents[bone]
        return bone

    def _carrier(self, bone: int, root: int) -> int:
        """The bone with skin that a bone without follows: the next above, else below."""
        if self.above[bone] >= 0:
            return self.above[bone]
        level = [bone]
        while level:
            level = [child for child, up in enumerate(self.character.parents) if up in level]
            for child in level:
                if len(self.clusters[child]):
                    return child
        return root

    def _find_twins(self) -> np.ndarray:
        """Index (n,) of the bone whose skin is each one's mirror image; its own where none is."""
        character, twins = self.character, np.arange(len(self.clusters))
        means = np.array([character.vertices[self.clusters[bone]].mean(axis=0)
                          for bone in self.skinned])
        # Half of the bones are on each side, whatever one hand holds.
        images = means * (1, -1, 1) + (0, 2 * np.median(means[:, 1]), 0)
        nearest = [int(np.argmin(np.linalg.norm(means - image, axis=1))) for image in images]
        for k, other in enumerate(nearest):
            off = np.linalg.norm(means[other] - images[k])
            if nearest[other] == k and off < PAIRED * character.extent:
                twins[self.skinned[k]] = self.skinned[other]
        return twins

    def _is_pelvis(self, bone: int) -> bool:
        """Whether it is named as hips; what is called a thigh and has a thigh is half of them."""
        below = [self.roles[k] for k in self.skinned
                 if self.above[k] == bone and k != self.twins[bone]]
        return self.roles[bone] == 'hips' or (self.roles[bone] == 'thigh' and 'thigh' in below)

    def _find_root(self) -> int:
        """The bone in the middle: the largest branch that hangs on it is as small as can be.

        Never one of two twins, if there is another.
        """
        halves = {bone for pair in self.halves for bone in pair}
        own = [bone for bone in self.skinned if bone in halves or (
            self.twins[bone] == bone and not side_of(self.character.bone_names[bone]))]
        tops = [bone for bone in self.skinned if self.above[bone] < 0]
        first = max(tops, key=lambda bone: self.areas[bone])

        def heaviest(bone: int) -> float:
            trusted = bone == first or (self.roles[bone] == 'hips' and bone in own)
            return self._largest_branch(bone) - trusted * TRUSTED

        return min(own or self.skinned, key=lambda bone: (round(heaviest(bone), 9), bone))

    def _largest_branch(self, root: int) -> float:
        """Share of all skin in the heaviest branch of a bone; its other half is none."""
        own = {root, *(bone for pair in self.halves if root in pair for bone in pair)}
        parents = self._parents_from(root)
        carried = self.areas.copy()
        largest = 0.0
        for bone in reversed(self._order):
            if bone in own:
                continue
            if parents[bone] in own:
                largest = max(largest, carried[bone])
            else:
                carried[parents[bone]] += carried[bone]
        return float(largest / max(self.areas.sum(), 1e-300))

    def _parents_from(self, root: int) -> list[int]:
        """Parents of all bones with skin, as seen from a root; -1 for others and the root."""
        next_to: dict[int, list[int]] = {bone: [] for bone in self.skinned}
        for a, b in self.edges:
            next_to[a].append(b)
            next_to[b].append(a)
        parents = [-1] * len(self.clusters)
        self._order = [root]
        for bone in self._order:
            for other in next_to[bone]:
                if other != parents[bone]:
                    parents[other] = bone
                    self._order.append(other)
        return parents

    def _anchors(self, bone: int, parent: int) -> list[np.ndarray]:
        """Points at which two bones may be jointed: the lower one's root, then where skins meet."""
        lower = parent if self.above[parent] == bone else bone
        points = [self.character.positions[lower]]
        middle = self.borders.middle(bone, parent)
        if middle is not None:
            points.append(middle)
        return [*points, nearest_points(self.character, self.clusters[bone],
                                        self.clusters[parent])]
