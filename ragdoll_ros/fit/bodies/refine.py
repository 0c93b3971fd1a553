"""A skin with its long edges halved, so that coarse meshes show their bones' shape too.

A leg may have vertices at the hip and at the hoof alone. New vertices are moved by the mean of
what moves the two ends of their edge.
"""
from __future__ import annotations

import dataclasses

import numpy as np

from ..reading.character import Character
from ..reading.skins import widened

LONGEST_EDGE = 0.025
"""Edges longer than this share of the character are halved."""

ROUNDS, ENOUGH = 8, 60_000
"""How often, and the vertices at which it stops."""

INFLUENCES = 8
"""Bones that a new vertex keeps, heaviest first."""


def refined(character: Character) -> Character:
    """The character with edges halved until all are short; its own vertices stay the first."""
    limit = LONGEST_EDGE * character.extent
    for _ in range(ROUNDS):
        corners = character.vertices[character.triangles]
        edges = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
        long = edges.max(axis=1, initial=0) > limit
        if not long.any() or len(character.vertices) + 3 * long.sum() > ENOUGH:
            break
        character = _split(character, long)
    return character


def _split(character: Character, chosen: np.ndarray) -> Character:
    """Cut the chosen triangles (t,) in four at the middles of their edges."""
    triangles = character.triangles[chosen]
    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    ends, middle = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
    a, b, c = triangles.T
    ab, bc, ca = (middle.reshape(-1, 3) + len(character.vertices)).T
    quarters = np.concatenate([np.stack(corner, axis=1) for corner in (
        (a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    bones, weights = _mixed(character, ends)
    width = max(bones.shape[1], character.bones.shape[1])
    return dataclasses.replace(
        character,
        vertices=np.concatenate([character.vertices, character.vertices[ends].mean(axis=1)]),
        triangles=np.concatenate([character.triangles[~chosen], quarters]),
        bones=np.concatenate([widened(character.bones, width), widened(bones, width)]),
        weights=np.concatenate([widened(character.weights, width), widened(weights, width)]))


def _mixed(character: Character, ends: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bones and weights (e, k) half way between the ends (e, 2), each bone once."""
    bones = character.bones[ends].reshape(len(ends), -1)
    weights = character.weights[ends].reshape(len(ends), -1) / 2
    same = bones[:, :, None] == bones[:, None, :]
    first = ~np.tril(same, -1).any(axis=2)
    totals = np.where(first, np.einsum('vij,vj->vi', same, weights), 0.0)
    # Equal weights in the order of their bones, so that left and right come out alike.
    order = np.lexsort((bones, -np.round(totals, 9)), axis=1)[:, :INFLUENCES]
    totals = np.take_along_axis(totals, order, axis=1)
    sums = totals.sum(axis=1, keepdims=True)
    totals = np.divide(totals, sums, out=np.zeros_like(totals), where=sums > 0)
    return np.take_along_axis(bones, order, axis=1), totals
