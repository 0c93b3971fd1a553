"""Which bones of a character are neighbours: edges between bones, by what their skins show.

The file's own edges come first where the skin agrees, then what shares most skin, then what is
nearest.
"""
from __future__ import annotations

import numpy as np

from ..reading.character import Character
from ..roles.names import LIMBS
from .borders import find_borders, find_gaps

AGREES = 0.1
"""The skin agrees with the file where bone and parent share this much of the most that the bone
shares with any."""

NOISE = 0.003
"""Skin shared by less than this share of the smaller bone's is a stray weight."""

TOUCHING = 0.03
"""Skins this near to each other, of the whole character, may be jointed."""

LARGE = 0.3
"""An island of more than this share of the skin is no limb that the file forgot to join."""

HALVES = 0.25
"""A left and a right bone are halves of one body if this share of their borders is common."""

PAIRED = 0.02
"""Left and right mirror each other to this share of the whole."""


class SkinForest:
    """The bones with skin of a character; ``edges`` join them until they are one tree.

    ``halves`` and ``tied`` are edges between bones that are one body, and between those that
    nothing joins. All by the bones' indices.
    """

    def __init__(self, character: Character, clusters: list[np.ndarray],
                 roles: tuple[str | None, ...]) -> None:
        self.character, self.clusters, self.roles = character, list(clusters), roles
        areas = character.vertex_areas()
        # Hair may have more skin than the body, and carries none of it.
        self.areas = np.array([0.0 if role == 'soft' else areas[cluster].sum()
                               for cluster, role in zip(clusters, roles, strict=True)])
        self.skinned = [bone for bone, cluster in enumerate(clusters) if len(cluster)]
        self.above = [self._skinned_above(bone) for bone in range(len(clusters))]
        self.twins = self._find_twins()
        self.borders = find_borders(character)
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
            inner = np.array([bone for bone in self.skinned if self._tree_of[bone] == island])
            outer = np.array([bone for bone in self.skinned if self._tree_of[bone] != island])
            between = gaps[np.ix_(inner, outer)]
            gap = between.min()
            row, column = np.unravel_index(np.argmin(between), between.shape)
            edge = int(inner[row]), int(outer[column])
            known = [(a, b) for a, b in file if self._tree_of[a] != self._tree_of[b]
                     and island in (self._tree_of[a], self._tree_of[b])]
            kept = min(known, key=lambda pair: (gaps[pair], pair), default=None)
            if kept and (gaps[kept] <= gap + near or gap > near):
                edge = kept
            large = self.areas[inner].sum() > LARGE * self.areas.sum()
            strange = not kept and self._file_root(edge[0]) != self._file_root(edge[1])
            if strange and (large or gap > near):
                # By its own root, as nothing is known of where it might turn.
                top = next(bone for bone in inner if self.above[bone] not in inner)
                edge = int(top), int(outer[np.argmin(gaps[top, outer])])
                self.tied.append(edge)
            self._join(*edge)

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
