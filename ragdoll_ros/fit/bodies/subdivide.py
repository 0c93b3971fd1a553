"""Mesh subdivision, so that the vertices of coarse meshes sample the shape of each bone.

A leg may have vertices at the hip and the hoof only. The influences of a new vertex are the mean
of those at both ends of its edge.
"""
import dataclasses

import numpy as np

from ..reading.character import Character
from ..reading.skins import pad_influences

MAX_EDGE = 0.025
"""Longest edge, as a fraction of the character's extent."""

MAX_PASSES, MAX_SUBDIVIDED = 8, 60_000
"""Passes, and the number of vertices at which subdivision stops."""

MAX_INFLUENCES = 8
"""Influences that a new vertex keeps, largest weights first."""


def subdivide(character: Character) -> Character:
    """The character with long edges bisected; the original vertices keep their indices."""
    limit = MAX_EDGE * character.extent
    for _ in range(MAX_PASSES):
        corners = character.vertices[character.triangles]
        edges = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
        long = edges.max(axis=1, initial=0) > limit
        if not long.any() or len(character.vertices) + 3 * long.sum() > MAX_SUBDIVIDED:
            break
        character = _split_triangles(character, long)
    return character


def _split_triangles(character: Character, chosen: np.ndarray) -> Character:
    """Split the chosen triangles (t,) into four at the midpoints of their edges."""
    triangles = character.triangles[chosen]
    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    ends, middle = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
    a, b, c = triangles.T
    ab, bc, ca = (middle.reshape(-1, 3) + len(character.vertices)).T
    quarters = np.concatenate([np.stack(corner, axis=1) for corner in (
        (a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    bones, weights = _mean_influences(character, ends)
    width = max(bones.shape[1], character.bones.shape[1])
    bones, weights = (np.concatenate([pad_influences(old, width), pad_influences(new, width)])
                      for old, new in ((character.bones, bones), (character.weights, weights)))
    return dataclasses.replace(
        character, bones=bones, weights=weights,
        vertices=np.concatenate([character.vertices, character.vertices[ends].mean(axis=1)]),
        triangles=np.concatenate([character.triangles[~chosen], quarters]))


def _mean_influences(character: Character, ends: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean bones and weights (e, k) of the vertices ``ends`` (e, 2), each bone once."""
    bones = character.bones[ends].reshape(len(ends), -1)
    weights = character.weights[ends].reshape(len(ends), -1) / 2
    same = bones[:, :, None] == bones[:, None, :]
    first = ~np.tril(same, -1).any(axis=2)
    totals = np.where(first, np.einsum('vij,vj->vi', same, weights), 0.0)
    # Ties are ordered by bone index, so that left and right get the same influences.
    order = np.lexsort((bones, -np.round(totals, 9)), axis=1)[:, :MAX_INFLUENCES]
    totals = np.take_along_axis(totals, order, axis=1)
    sums = totals.sum(axis=1, keepdims=True)
    totals = np.divide(totals, sums, out=np.zeros_like(totals), where=sums > 0)
    return np.take_along_axis(bones, order, axis=1), totals
