"""Bodies that overlap a little without a joint between them are cut back until they do not.

Two thighs touch at the crotch; as bodies they would push each other apart from the start. What
overlaps deeply stays as it is, and is let through (see colliding_pairs).
"""
from __future__ import annotations

import dataclasses

import numpy as np

from ...model import rotation
from ...model.ragdoll import Bone
from ...model.shapes import Box, Shape, Sphere
from ..shapes.shapes import Fitted
from ..skeleton.anchors import NEAR, outside
from ..skeleton.groups import Group
from .overlap import DEEP

SHALLOW = 0.35
"""Overlaps up to this share of half the thinner body's thickness are cut away."""

ROUNDS = 6

_HEIGHTS = np.linspace(-1, 1, 201)
_AROUND = np.pi * (3 - np.sqrt(5)) * np.arange(201)
WAYS = np.stack([np.sqrt(1 - _HEIGHTS ** 2) * np.cos(_AROUND),
                 np.sqrt(1 - _HEIGHTS ** 2) * np.sin(_AROUND), _HEIGHTS], axis=1)
"""Unit directions (201, 3), evenly on the sphere: a spiral of the golden angle."""


def trimmed(groups: list[Group], fits: list[Fitted], frames: list[np.ndarray]) -> list[Fitted]:
    """The groups' bodies without the shallow overlaps of those that no joint connects.

    What would take a body away from its joint is not cut.

    ``fits`` are centred in the doll's frame, ``frames`` (3, 3) have their axes as columns.
    """
    bones = [Bone(group.name, fit.shape, 1.0, fit.centre, rotation.from_matrix(frame))
             for group, fit, frame in zip(groups, fits, frames, strict=True)]
    pairs = [(i, k) for k in range(len(bones)) for i in range(k)
             if groups[k].parent != i and groups[i].parent != k]
    anchors = [np.array([each.anchor for k, each in enumerate(groups) if each.parent >= 0
                         and not each.tied and index in (k, each.parent)]).reshape(-1, 3)
               for index in range(len(groups))]
    most = {pair: SHALLOW * min(min(bones[k].shape.half_extents) for k in pair) for pair in pairs}
    for _ in range(ROUNDS):
        cuts = [cut for pair in pairs for cut in _cuts(bones, pair, most[pair])]
        for index, way, depth in cuts:
            less = _cut(bones[index], way, depth)
            if _holds(less, anchors[index]):
                bones[index] = less
        if not cuts:
            break
    return [dataclasses.replace(fit, shape=bone.shape, centre=np.array(bone.position))
            for fit, bone in zip(fits, bones, strict=True)]


def _holds(bone: Bone, anchors: np.ndarray) -> bool:
    """Whether a body is still at all its joints (k, 3)."""
    return bool((outside(bone.shape, bone.pose.apply_inverse(anchors)) <= NEAR).all())


def _cuts(bones: list[Bone], pair: tuple[int, int],
          most: float) -> list[tuple[int, np.ndarray, float]]:
    """What to cut off each of two bodies: its index, the direction (3,) and how much, m."""
    first, second = (bones[k] for k in pair)
    sizes = [float(np.linalg.norm(bone.shape.half_extents)) for bone in (first, second)]
    if np.linalg.norm(np.subtract(first.position, second.position)) > sum(sizes):
        return []
    depth, way = _penetration(first, second)
    if not DEEP / 2 < depth <= most:
        return []
    return [(pair[0], way, depth / 2), (pair[1], -way, depth / 2)]


def _penetration(first: Bone, second: Bone) -> tuple[float, np.ndarray]:
    """How deep two convex bodies are in each other, m, and the unit direction (3,) of the way out.

    The least of h_a(n) + h_b(-n) - n d over directions n, with h the bodies' support functions and
    d from a's centre to b's; below zero where they are apart.
    """
    apart = np.subtract(second.position, first.position)
    axes = np.concatenate([rotation.matrix(np.array(bone.orientation)).T
                           for bone in (first, second)])
    tried = np.concatenate([WAYS, axes, -axes, apart[None]])
    for spread in (0.1, 0.02, 0.0):
        tried = tried / np.maximum(np.linalg.norm(tried, axis=1, keepdims=True), 1e-12)
        depths = _reach(first, tried) + _reach(second, -tried) - tried @ apart
        best = tried[np.argmin(depths)]
        tried = np.concatenate([best[None], best + spread * WAYS])
    return float(depths.min()), best


def _reach(bone: Bone, ways: np.ndarray) -> np.ndarray:
    """How far (k,) m a body reaches from its centre along directions (k, 3) of the doll's frame."""
    return bone.shape.support(rotation.rotate(rotation.inverse(np.array(bone.orientation)), ways))


def _cut(bone: Bone, way: np.ndarray, depth: float) -> Bone:
    """The body, reaching ``depth`` m less far along a unit direction (3,); its far side stays."""
    turned = rotation.rotate(rotation.inverse(np.array(bone.orientation)), way)
    shape, back = _narrower(bone.shape, turned, depth)
    return dataclasses.replace(bone, shape=shape, position=bone.pose.apply(back[None])[0])


def _narrower(shape: Shape, way: np.ndarray, depth: float) -> tuple[Shape, np.ndarray]:
    """The shape that is left, and where (3,) its centre is, in the frame of the shape."""
    if isinstance(shape, Sphere):
        return Sphere(shape.radius - depth / 2), -way * depth / 2
    if isinstance(shape, Box):
        axis = int(np.argmax(np.abs(way)))
        less = np.eye(3)[axis] * depth / abs(way[axis])
        return Box(tuple(np.array(shape.size) - less)), -np.sign(way[axis]) * less / 2
    across = float(np.hypot(*way[:2]))
    if across < abs(way[2]):
        less = min(depth / abs(way[2]), shape.length / 2)
        back = np.array([0, 0, -np.sign(way[2]) * less / 2])
        return dataclasses.replace(shape, length=shape.length - less), back
    less = min(depth / across, shape.radius / 2)
    return (dataclasses.replace(shape, radius=shape.radius - less / 2),
            np.array([*(-way[:2] / across), 0]) * less / 2)
