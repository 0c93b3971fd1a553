"""Bodies as triangles and as points: for pictures, and for how far they overlap."""
from __future__ import annotations

import numpy as np

from .. import rotation
from ..ragdoll import Bone, Box, Capsule, Cylinder, Shape
from .shapes import outside

SEGMENTS = 20
"""Corners of a circle."""

DEEP = 0.001
"""Bodies overlap where one's point is deeper than this in the other, m."""


def surface(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Corners (p, 3) m and triangles (t, 3) of a shape, its own axes, seen from outside."""
    if isinstance(shape, Box):
        signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        quads = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4],
                          [1, 5, 7, 3]])
        triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
        return signs * np.array(shape.half_extents), triangles
    angles = np.linspace(-np.pi / 2, np.pi / 2, SEGMENTS // 2)
    radius = shape.radius
    if isinstance(shape, Cylinder):
        radii = np.array([0, radius, radius, 0])
        heights = np.array([-1, -1, 1, 1]) * shape.length / 2
    else:
        radii, heights = radius * np.cos(angles), radius * np.sin(angles)
        if isinstance(shape, Capsule):
            heights = heights + np.where(angles < 0, -1, 1) * shape.length / 2
    return _turned(radii, heights)


def _turned(radii: np.ndarray, heights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Surface of revolution about z of a profile that runs upwards."""
    turn = np.linspace(0, 2 * np.pi, SEGMENTS, endpoint=False)
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    rings = np.concatenate([radii[:, None, None] * circle,
                            np.broadcast_to(heights[:, None, None], (len(radii), SEGMENTS, 1))], 2)
    index = np.arange(len(radii) * SEGMENTS).reshape(len(radii), SEGMENTS)
    low, high = index[:-1], index[1:]
    after_low, after_high = np.roll(low, -1, axis=1), np.roll(high, -1, axis=1)
    triangles = np.concatenate([np.stack([low, after_low, after_high], -1).reshape(-1, 3),
                                np.stack([low, after_high, high], -1).reshape(-1, 3)])
    return rings.reshape(-1, 3), triangles


def filling(shape: Shape) -> np.ndarray:
    """Points (p, 3) m that fill a shape evenly, its own axes: about 500 in a box."""
    ticks = (np.arange(8) + 0.5) / 4 - 1
    lattice = np.stack(np.meshgrid(ticks, ticks, ticks), -1).reshape(-1, 3)
    points = lattice * np.array(shape.half_extents)
    return points[outside(shape, points) <= 0]


def placed(bone: Bone, points: np.ndarray) -> np.ndarray:
    """Points (p, 3) of a body's own axes in the doll's frame."""
    return rotation.rotate(np.array(bone.orientation), points) + bone.position


def depth_in(bone: Bone, points: np.ndarray) -> np.ndarray:
    """How deep (p,) m points of the doll's frame are in a body; below zero outside."""
    back = rotation.inverse(np.array(bone.orientation))
    return -outside(bone.shape, rotation.rotate(back, points - np.array(bone.position)))


def overlapping_pairs(bones: tuple[Bone, ...]) -> list[tuple[str, str]]:
    """Find the pairs of bodies that overlap in the bind pose."""
    clouds = [np.concatenate([placed(bone, surface(bone.shape)[0]),
                              placed(bone, filling(bone.shape))]) for bone in bones]
    reaches = [float(np.linalg.norm(bone.shape.half_extents)) for bone in bones]
    found = []
    for i, first in enumerate(bones):
        for j in range(i + 1, len(bones)):
            second = bones[j]
            apart = np.linalg.norm(np.subtract(first.position, second.position))
            if apart < reaches[i] + reaches[j] and (
                    depth_in(first, clouds[j]).max() > DEEP
                    or depth_in(second, clouds[i]).max() > DEEP):
                found.append((first.name, second.name))
    return found


def covered(bones: tuple[Bone, ...], points: np.ndarray, tolerance: float) -> np.ndarray:
    """Tell which points (p,) of the doll's frame lie in some body, or within the tolerance."""
    inside = np.zeros(len(points), bool)
    for bone in bones:
        inside[~inside] = depth_in(bone, points[~inside]) >= -tolerance
    return inside


def shared_volume(bones: tuple[Bone, ...]) -> float:
    """Share of the bodies' volume, 0 to 1, that lies in another body too."""
    whole = shared = 0.0
    for bone in bones:
        points = placed(bone, filling(bone.shape))
        others = tuple(other for other in bones if other is not bone)
        share = float(np.mean(covered(others, points, 0.0))) if others else 0.0
        whole += bone.shape.volume
        shared += share * bone.shape.volume
    return shared / whole
