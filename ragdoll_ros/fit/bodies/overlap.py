"""Overlap of bodies with each other and coverage of the skin, in the bind pose."""
import numpy as np

from ...model.ragdoll import Bone, Ragdoll
from ...model.shapes import Shape

MIN_OVERLAP = 0.001
"""m; penetration depth from which on two bodies overlap."""


def interior_points(shape: Shape) -> np.ndarray:
    """Points (p, 3) m on a regular grid inside a shape, in its own axes: about 500 in a box."""
    ticks = (np.arange(8) + 0.5) / 4 - 1
    lattice = np.stack(np.meshgrid(ticks, ticks, ticks), -1).reshape(-1, 3)
    points = lattice * np.array(shape.half_extents)
    return points[shape.signed_distance(points) <= 0]


def sample_points(bone: Bone) -> np.ndarray:
    """Points (p, 3) m on the surface and in the interior of a body, doll's frame."""
    return bone.pose.apply(np.concatenate([bone.shape.mesh()[0], interior_points(bone.shape)]))


def penetration_depth(bone: Bone, points: np.ndarray) -> np.ndarray:
    """Penetration depth (p,) m of points (p, 3) m, doll's frame; negative outside the body."""
    return -bone.shape.signed_distance(bone.pose.apply_inverse(points))


def overlapping_pairs(bones: tuple[Bone, ...],
                      least: float = MIN_OVERLAP) -> list[tuple[str, str]]:
    """Names of the pairs of bodies that overlap by more than ``least`` m; if ``least`` is negative,
    also of those with a gap smaller than ``-least``.
    """
    samples = [sample_points(bone) for bone in bones]
    radii = [float(np.linalg.norm(bone.shape.half_extents)) for bone in bones]
    found = []
    for i, first in enumerate(bones):
        for j in range(i + 1, len(bones)):
            second = bones[j]
            distance = np.linalg.norm(np.subtract(first.position, second.position))
            if distance < radii[i] + radii[j] - min(least, 0.0) and (
                    penetration_depth(first, samples[j]).max() > least
                    or penetration_depth(second, samples[i]).max() > least):
                found.append((first.name, second.name))
    return found


def colliding_overlaps(doll: Ragdoll, least: float = MIN_OVERLAP) -> tuple[tuple[str, str], ...]:
    """Names of the pairs of bodies that overlap by more than ``least`` m and that may collide."""
    excluded = doll.excluded_pairs
    return tuple(pair for pair in overlapping_pairs(doll.bones, least)
                 if frozenset(pair) not in excluded)


def covered(bones: tuple[Bone, ...], points: np.ndarray, tolerance: float) -> np.ndarray:
    """Mask (p,) of the points (p, 3) m, doll's frame, inside a body or within ``tolerance`` m."""
    inside = np.zeros(len(points), bool)
    for bone in bones:
        inside[~inside] = penetration_depth(bone, points[~inside]) >= -tolerance
    return inside


def overlap_share(bones: tuple[Bone, ...]) -> float:
    """Fraction of the bodies' total volume, 0 to 1, that lies inside another body."""
    whole = shared = 0.0
    for bone in bones:
        points = bone.pose.apply(interior_points(bone.shape))
        others = tuple(other for other in bones if other is not bone)
        share = float(np.mean(covered(others, points, 0.0))) if others else 0.0
        whole += bone.shape.volume
        shared += share * bone.shape.volume
    return shared / whole
