"""Edges between the bones of a character: those of its file, and those that its skin shows.

Plausible edges of the file come first: the skin confirms them, or their joint lies in or near both
bodies. Next are the pairs that share most skin, and last the nearest pairs.
"""
import numpy as np

from ...files.bone_names.names import ARM, LEG, SINGLE_ROLES, side_of
from ..reading.character import Character
from .skin_adjacency import cluster_distances, find_adjacency

MIN_FILE_AREA = 0.1
"""The skin confirms an edge of the file if bone and parent share this fraction of the largest area
that the bone shares with any bone."""

MIN_SHARED_AREA = 0.003
"""Fraction of the smaller bone's skin below which shared skin is noise in the weights."""

TOUCH_DISTANCE = 0.03
"""Distance between skins that a joint may bridge, as a fraction of the character's extent."""

MAX_LOOSE_AREA = 0.3
"""Fraction of the skin above which a detached part is no limb with a missing edge."""

MIN_HALF_AREA = 0.25
"""Fraction of its shared skin that a left bone shares with the right one: halves of one body."""

MIRROR_TOLERANCE = 0.02
"""Largest deviation of a mirror image, as a fraction of the character's extent."""


class SkinForest:
    """The skinned bones of a character, by index; joining adds ``edges`` until they form one tree.

    ``halves`` are edges within one body. ``fixed`` are edges that neither file nor skin suggests,
    to a part that is large or not near.
    """

    def __init__(self, character: Character, clusters: list[np.ndarray],
                 roles: tuple[str | None, ...]) -> None:
        self.character, self.clusters, self.roles = character, list(clusters), roles
        areas = character.vertex_areas()
        # Hair may have more skin than the body, but supports none of it.
        self.areas = np.array([0.0 if role == 'soft' else areas[cluster].sum()
                               for cluster, role in zip(clusters, roles, strict=True)])
        self.skinned = [bone for bone, cluster in enumerate(clusters) if len(cluster)]
        self.skinned_parents = [self._skinned_above(bone) for bone in range(len(clusters))]
        self.joint_distances = self._find_joint_distances()
        self.mirrored = self._find_mirrored()
        self.adjacency = find_adjacency(character)
        # Symmetrized, so that left and right get the same edges.
        shared = self.adjacency.shared_area
        self.shared = shared + shared[np.ix_(self.mirrored, self.mirrored)]
        self.edges: list[tuple[int, int]] = []
        self.halves: list[tuple[int, int]] = []
        self.fixed: list[tuple[int, int]] = []
        self._tree_of = np.arange(len(clusters))

    def join_halves(self) -> None:
        """Join left and right bones to one body where they share much skin or are halves of the
        pelvis.
        """
        for bone in self.skinned:
            other = int(self.mirrored[bone])
            total = self.shared[bone].sum()
            if bone < other and (self._is_pelvis(bone) or (
                    self.roles[bone] not in SINGLE_ROLES
                    and self.shared[bone, other] > MIN_HALF_AREA * total > 0)):
                self._join(bone, other)
                self.halves.append((bone, other))

    def join_file_edges(self, trusted: bool) -> None:
        """Connect bones to their parents in the file where their skins meet, or where the bone's
        joint lies in or near both; everywhere if the file is ``trusted``.
        """
        for bone in self.skinned:
            parent = self.skinned_parents[bone]
            if parent >= 0 and (trusted or (
                    self.mirrored[bone] != parent and self._can_be(bone, parent))):
                self._join(bone, parent)

    def join_shared_skin(self) -> None:
        """Connect bones that share skin, the largest shared area first, but not mirrored bones, nor
        an arm and a leg, nor limbs of two sides.
        """
        least = MIN_SHARED_AREA * np.minimum(self.areas[:, None], self.areas)
        pairs = [(a, b) for a, b in np.argwhere(np.triu(self.shared > least))
                 if self.mirrored[a] != b and len(self.clusters[a]) and len(self.clusters[b])
                 and not self._are_limbs_apart(a, b)]
        for a, b in sorted(pairs, key=lambda pair: -self.shared[pair]):
            self._join(int(a), int(b))

    def join_nearest(self) -> None:
        """Connect the remaining trees: by an edge of the file if it is about as short as the
        shortest or no edge is short, else by the shortest.
        """
        if len(self._trees()) == 1:
            return
        distances = cluster_distances(self.character, self.clusters)
        touching = TOUCH_DISTANCE * self.character.extent
        file_edges = {(bone, parent) for bone in self.skinned
                      if (parent := self.skinned_parents[bone]) >= 0}
        # Mirror images are connected to each other only as a last resort.
        distances[self.skinned, self.mirrored[self.skinned]] += self.character.extent
        while len(trees := self._trees()) > 1:
            island = min(trees, key=lambda tree: self.areas[self._tree_of == tree].sum())
            inside = np.array([bone for bone in self.skinned if self._tree_of[bone] == island])
            outside = np.array([bone for bone in self.skinned if self._tree_of[bone] != island])
            between = distances[np.ix_(inside, outside)]
            distance = between.min()
            row, column = np.unravel_index(np.argmin(between), between.shape)
            edge = int(inside[row]), int(outside[column])
            file_links = [(a, b) for a, b in file_edges if self._tree_of[a] != self._tree_of[b]
                          and island in (self._tree_of[a], self._tree_of[b])]
            file_edge = min(file_links, key=lambda pair: (distances[pair], pair), default=None)
            if file_edge and (distances[file_edge] <= distance + touching or distance > touching):
                edge = file_edge
            large = self.areas[inside].sum() > MAX_LOOSE_AREA * self.areas.sum()
            unrelated = not file_edge and self._file_root(edge[0]) != self._file_root(edge[1])
            if unrelated and (large or distance > touching):
                # At its own root: where it could articulate is unknown.
                top = next(bone for bone in inside if self.skinned_parents[bone] not in inside)
                edge = int(top), int(outside[np.argmin(distances[top, outside])])
                self.fixed.append(edge)
            self._join(*edge)

    def _can_be(self, bone: int, parent: int) -> bool:
        """Whether an edge of the file is plausible.

        The skin confirms it, or the bone's joint lies in or near both bodies. And no other bone is
        nearer to the joint and shares more skin, or as much where the skin does not confirm the
        edge: a hand may hang beside the hips.
        """
        shared, off = self.shared[bone], self.joint_distances[bone]
        confirmed = shared[parent] > MIN_FILE_AREA * shared.max() > 0
        near = max(off[bone], off[parent]) <= TOUCH_DISTANCE * self.character.extent
        more = shared > shared[parent] if confirmed else shared >= shared[parent]
        others = [other for other in np.flatnonzero((off < off[parent]) & more)
                  if other != bone and self.skinned_parents[other] != bone]
        return bool(confirmed or near) and not others

    def _find_joint_distances(self) -> np.ndarray:
        """Distances (n, n) m of the root of each bone from the box about the skin of each bone;
        infinite for a bone without skin.
        """
        character, found = self.character, np.full((len(self.clusters),) * 2, np.inf)
        for bone in self.skinned:
            skin = character.vertices[self.clusters[bone]]
            off = np.maximum(skin.min(axis=0) - character.positions,
                             character.positions - skin.max(axis=0)).clip(min=0.0)
            found[:, bone] = np.linalg.norm(off, axis=1)
        return found

    def _are_limbs_apart(self, a: int, b: int) -> bool:
        """Whether by their names two bones are of an arm and a leg, or of limbs of two sides."""
        limbs = [next((limb for limb in (ARM, LEG) if self.roles[bone] in limb), None)
                 for bone in (a, b)]
        sides = [side_of(self.character.bone_names[bone]) for bone in (a, b)]
        return None not in limbs and (limbs[0] != limbs[1] or sides[0] * sides[1] < 0)

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

    def _find_mirrored(self) -> np.ndarray:
        """Index (n,) of the bone with the mirrored skin; the bone's own where there is none."""
        character, mirrored = self.character, np.arange(len(self.clusters))
        means = np.array([character.vertices[self.clusters[bone]].mean(axis=0)
                          for bone in self.skinned])
        # The median: half of the bones are on each side, whatever a hand holds.
        images = means * (1, -1, 1) + (0, 2 * np.median(means[:, 1]), 0)
        nearest = [int(np.argmin(np.linalg.norm(means - image, axis=1))) for image in images]
        for k, other in enumerate(nearest):
            off = np.linalg.norm(means[other] - images[k])
            if nearest[other] == k and off < MIRROR_TOLERANCE * character.extent:
                mirrored[self.skinned[k]] = self.skinned[other]
        return mirrored

    def _is_pelvis(self, bone: int) -> bool:
        """Whether a bone has the role of the hips, or is a thigh with a thigh below it: half of the
        hips.
        """
        below = [self.roles[k] for k in self.skinned
                 if self.skinned_parents[k] == bone and k != self.mirrored[bone]]
        return self.roles[bone] == 'hips' or (self.roles[bone] == 'thigh' and 'thigh' in below)
