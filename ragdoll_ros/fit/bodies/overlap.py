"""How far bodies overlap each other, and how much of a skin they cover; bind pose."""
from __future__ import annotations

import numpy as np

from ...model.ragdoll import Bone, Ragdoll
from ...model.shapes import Shape

DEEP = 0.001
"""Bodies overlap where one's point is deeper than this in the other, m."""


def filling(shape: Shape) -> np.ndarray:
    """Points (p, 3) m that fill a shape evenly, its own axes: about 500 in a box."""
    ticks = (np.arange(8) + 0.5) / 4 - 1
    lattice = np.stack(np.meshgrid(ticks, ticks, ticks), -1).reshape(-1, 3)
    points = lattice * np.array(shape.half_extents)
    return points[shape.signed_distance(points) <= 0]


def cloud(bone: Bone) -> np.ndarray:
    """Points (p, 3) m on a body and in it, doll's frame."""
    return bone.pose.apply(np.concatenate([bone.shape.mesh()[0], filling(bone.shape)]))


def depth_in(bone: Bone, points: np.ndarray) -> np.ndarray:
    """How deep (p,) m points (p, 3) of the doll's frame are in a body; below zero outside."""
    return -bone.shape.signed_distance(bone.pose.apply_inverse(points))


def overlapping_pairs(bones: tuple[Bone, ...]) -> list[tuple[str, str]]:
    """Names of the pairs of bodies that overlap by more than DEEP."""
    clouds = [cloud(bone) for bone in bones]
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


def colliding_pairs(doll: Ragdoll) -> tuple[tuple[str, str], ...]:
    """Names of the pairs of bodies that overlap and that the doll lets collide."""
    return tuple(pair for pair in overlapping_pairs(doll.bones)
                 if frozenset(pair) not in doll.excluded_pairs)


def covered(bones: tuple[Bone, ...], points: np.ndarray, tolerance: float) -> np.ndarray:
    """Which (p,) of points (p, 3) m, doll's frame, lie in some body, or within ``tolerance`` m."""
    inside = np.zeros(len(points), bool)
    for bone in bones:
        inside[~inside] = depth_in(bone, points[~inside]) >= -tolerance
    return inside


def shared_volume(bones: tuple[Bone, ...]) -> float:
    """Share of the bodies' volume, 0 to 1, that lies in another body too."""
    whole = shared = 0.0
    for bone in bones:
        points = bone.pose.apply(filling(bone.shape))
        others = tuple(other for other in bones if other is not bone)
        share = float(np.mean(covered(others, points, 0.0))) if others else 0.0
        whole += bone.shape.volume
        shared += share * bone.shape.volume
    return shared / whole
