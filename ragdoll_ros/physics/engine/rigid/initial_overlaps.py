"""Initial overlaps: bones that are placed in the ground, in bodies or in other dolls, or that joint
angles put into bones of their own doll.
"""
from collections.abc import Iterator

import numpy as np

from ....model.coordinates import DofLayout
from ....model.scene import Scene
from ....model.state import State
from ...accuracy import DRAFT
from ...kernels.system import gap_count
from ...rigid_body import GroundHeights
from ..protocol import GROUND, Overlap
from .broad_phase import BroadPhase
from .clusters import Cluster, Clusters

TOLERANCE = 1e-3
"""m: shallower overlaps are contacts. The kernels' STILL_OVERLAPPING is the same: bones of one doll
that overlap by more do not collide until they have separated."""

Pair = tuple[int, int]
"""A bone, and the bone that it is in, or GROUND, or FIRST_BODY - i for a scene's body i."""

FIRST_BODY = GROUND - 1


def find_overlaps(scene: Scene, clusters: Clusters, broad_phase: BroadPhase, layout: DofLayout,
                  q: np.ndarray) -> tuple[Overlap, ...]:
    """Overlaps deeper than TOLERANCE at coordinates ``q`` (nq,), the deepest first, one for each
    bone and what it is in. Those within a doll that exist at joint angles of zero as well, and are
    there less than TOLERANCE shallower, are left out: the doll is made so. Leaves ``clusters`` in
    another state.
    """
    found = _depths(scene, clusters, broad_phase, q)
    if any(_is_within_doll(scene, pair) for pair in found):
        straight = layout.with_joint_angles(q, np.zeros(len(scene.angle_names)))
        for pair, depth in _depths(scene, clusters, broad_phase, straight).items():
            if _is_within_doll(scene, pair) and found.get(pair, 0.0) < depth + TOLERANCE:
                found.pop(pair, None)
    return tuple(Overlap(scene.bone_names[bone],
                         scene.touched_name(other, FIRST_BODY - other), depth)
                 for (bone, other), depth in sorted(found.items(), key=lambda item: -item[1]))


def _is_within_doll(scene: Scene, pair: Pair) -> bool:
    bone, other = pair
    return other >= 0 and scene.doll_of_bone[bone] == scene.doll_of_bone[other]


def _depths(scene: Scene, clusters: Clusters, broad_phase: BroadPhase,
            q: np.ndarray) -> dict[Pair, float]:
    """Depth, m, of all that overlaps at ``q`` by more than TOLERANCE."""
    everything = np.ones(len(scene.dolls), bool)
    clusters.q[:] = q
    clusters.separate()
    clusters.exclude([np.zeros_like(flags) for flags in clusters.excluded(0)])
    clusters.advance(0.0, DRAFT, ~everything)
    states = clusters.bone_states
    clusters.static_geoms.update(states, 0.0, everything)
    clusters.form(broad_phase.pairs(states, 0.0, everything, everything, clusters.of_doll))
    clusters.advance(0.0, DRAFT, ~everything)
    deepest: dict[Pair, float] = {}
    for pair, depth in _overlapping(scene, clusters):
        deepest[pair] = max(depth, deepest.get(pair, 0.0))
    return deepest


def _overlapping(scene: Scene, clusters: Clusters) -> Iterator[tuple[Pair, float]]:
    """Yield all that overlaps by more than TOLERANCE: the Pair and the depth, m, of each bone in
    the ground and of each pair of geoms.
    """
    heights = GroundHeights(scene)(State.of(clusters.bone_states))
    for bone in np.flatnonzero((heights < -TOLERANCE) & scene.yielding_bones).tolist():
        yield (bone, GROUND), -float(heights[bone])
    for cluster in clusters.members:
        pairs = cluster.system.pairs
        count = gap_count(cluster.system)
        gaps = cluster.state.gaps[count - len(pairs):count]
        touching = np.flatnonzero(gaps < -TOLERANCE)
        if not len(touching):
            continue
        owners, pairs = _owners(clusters, cluster), pairs[touching]
        for a, b, gap in zip(owners[pairs['a']].tolist(), owners[pairs['b']].tolist(),
                             gaps[touching].tolist(), strict=True):
            yield (a, b), -gap


def _owners(clusters: Clusters, cluster: Cluster) -> np.ndarray:
    """Bone (g,) of each geom of a cluster, or FIRST_BODY - i for the static body i."""
    static = clusters.static_bodies(cluster)
    own = cluster.system.geoms['body'][:len(cluster.system.geoms) - len(static)]
    return np.concatenate([cluster.bones[cluster.system.tree['bone']][own], FIRST_BODY - static])
