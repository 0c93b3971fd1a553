"""Bodies extended to the anchors of their joints, and trimmed where others overlap them.

An anchor is the child bone's root where both bodies reach it, else where the skins meet.

Two thighs touch at the crotch; as bodies they would push each other apart at the start. Deep
overlaps stay and are excluded from collision (see colliding_overlaps).
"""
import dataclasses

import numpy as np

from ...model import rotation
from ...model.ragdoll import Bone
from ...model.shapes import Box, Shape, Sphere
from ..shapes.fitting import FittedShape, extend_to
from ..skeleton.groups import BodyGroup
from .overlap import MIN_OVERLAP

MAX_TRIM = 0.35
"""Deepest overlap that is trimmed, as a fraction of the thinner body's half thickness."""

MAX_ROUNDS = 6

_HEIGHTS = np.linspace(-1, 1, 201)
_AROUND = np.pi * (3 - np.sqrt(5)) * np.arange(201)
DIRECTIONS = np.stack([np.sqrt(1 - _HEIGHTS ** 2) * np.cos(_AROUND),
                       np.sqrt(1 - _HEIGHTS ** 2) * np.sin(_AROUND), _HEIGHTS], axis=1)
"""Unit directions (201, 3), evenly spread over the sphere: a golden-angle spiral."""

ANCHOR_TOLERANCE = 0.06
"""Largest distance of an anchor from its body, as a fraction of the body's longest extent."""

MAX_EXTENSION = 0.4
"""Largest extension of a body towards its anchor, as a fraction of the body's extent."""


def place_anchors(groups: list[BodyGroup], fits: list[FittedShape],
                  frames: list[np.ndarray]) -> list[FittedShape]:
    """Choose each group's anchor, and extend shapes within MAX_EXTENSION of an anchor to reach it.

    The anchor is the first candidate within ANCHOR_TOLERANCE of both bodies, else the nearest. The
    centres of the ``fits`` are in the doll's frame; ``frames`` (3, 3) have the shapes' axes as
    columns.
    """
    jointed = [(index, group) for index, group in enumerate(groups)
               if group.parent >= 0 and not group.fixed]
    for index, group in jointed:
        distances = [max(_anchor_distance(fits[k], frames[k], point) for k in (index, group.parent))
               for point in group.anchors]
        reached = [number for number, value in enumerate(distances) if value <= ANCHOR_TOLERANCE]
        group.anchor = group.anchors[reached[0] if reached else int(np.argmin(distances))]
    extended = list(fits)
    for index, group in jointed:
        for k in (index, group.parent):
            if _anchor_distance(fits[k], frames[k], group.anchor) <= MAX_EXTENSION:
                old, frame = extended[k], frames[k]
                new = extend_to(old.shape, (group.anchor - old.centre) @ frame)
                extended[k] = dataclasses.replace(
                    new, centre=old.centre + frame @ new.centre, coverage=old.coverage)
    return extended


def _anchor_distance(fit: FittedShape, frame: np.ndarray, point: np.ndarray) -> float:
    """Distance of a point outside a body, as a fraction of the body's longest extent."""
    return max(0.0, float(relative_distance(fit.shape, ((point - fit.centre) @ frame)[None])[0]))


def relative_distance(shape: Shape, points: np.ndarray) -> np.ndarray:
    """Signed distance (k,) of points (k, 3) in a shape's frame over its longest extent."""
    return shape.signed_distance(points) / (2 * max(shape.half_extents))


def trim_overlaps(groups: list[BodyGroup], fits: list[FittedShape],
                  frames: list[np.ndarray]) -> list[FittedShape]:
    """The groups' shapes without shallow overlaps between bodies that no joint connects.

    A cut that would move a body away from one of its joints is not made. The centres of the
    ``fits`` are in the doll's frame; ``frames`` (3, 3) have the shapes' axes as columns.
    """
    bones = [Bone(group.name, fit.shape, 1.0, fit.centre, rotation.from_matrix(frame))
             for group, fit, frame in zip(groups, fits, frames, strict=True)]
    pairs = [(i, k) for k in range(len(bones)) for i in range(k)
             if groups[k].parent != i and groups[i].parent != k]
    anchors = [np.array([each.anchor for k, each in enumerate(groups) if each.parent >= 0
                         and not each.fixed and index in (k, each.parent)]).reshape(-1, 3)
               for index in range(len(groups))]
    most = {pair: MAX_TRIM * min(min(bones[k].shape.half_extents) for k in pair) for pair in pairs}
    for _ in range(MAX_ROUNDS):
        cuts = [cut for pair in pairs for cut in _cuts(bones, pair, most[pair])]
        for index, direction, depth in cuts:
            cut = _cut(bones[index], direction, depth)
            distances = relative_distance(cut.shape, cut.pose.apply_inverse(anchors[index]))
            if (distances <= ANCHOR_TOLERANCE).all():
                bones[index] = cut
        if not cuts:
            break
    return [dataclasses.replace(fit, shape=bone.shape, centre=np.array(bone.position))
            for fit, bone in zip(fits, bones, strict=True)]


def _cuts(bones: list[Bone], pair: tuple[int, int],
          most: float) -> list[tuple[int, np.ndarray, float]]:
    """Cuts for two bodies: index of the body, direction (3,) and depth, m."""
    first, second = (bones[k] for k in pair)
    sizes = [float(np.linalg.norm(bone.shape.half_extents)) for bone in (first, second)]
    if np.linalg.norm(np.subtract(first.position, second.position)) > sum(sizes):
        return []
    depth, direction = _penetration(first, second)
    if not MIN_OVERLAP / 2 < depth <= most:
        return []
    return [(pair[0], direction, depth / 2), (pair[1], -direction, depth / 2)]


def _penetration(first: Bone, second: Bone) -> tuple[float, np.ndarray]:
    """Penetration depth of two convex bodies, m, and the unit separating direction (3,).

    The minimum of h_a(n) + h_b(-n) - n d over directions n, with the bodies' support functions h
    and the offset d from a's centre to b's; negative for separated bodies.
    """
    offset = np.subtract(second.position, first.position)
    axes = np.concatenate([rotation.matrix(np.array(bone.orientation)).T
                           for bone in (first, second)])
    tried = np.concatenate([DIRECTIONS, axes, -axes, offset[None]])
    for spread in (0.1, 0.02, 0.0):
        tried = tried / np.maximum(np.linalg.norm(tried, axis=1, keepdims=True), 1e-12)
        depths = _support(first, tried) + _support(second, -tried) - tried @ offset
        best = tried[np.argmin(depths)]
        tried = np.concatenate([best[None], best + spread * DIRECTIONS])
    return float(depths.min()), best


def _support(bone: Bone, directions: np.ndarray) -> np.ndarray:
    """Support function (k,) m of a body about its centre; directions (k, 3), doll's frame."""
    back = rotation.inverse(np.array(bone.orientation))
    return bone.shape.support(rotation.rotate(back, directions))


def _cut(bone: Bone, direction: np.ndarray, depth: float) -> Bone:
    """The body cut by ``depth`` m on the side of a unit direction (3,); the opposite side does not
    move.
    """
    local = rotation.rotate(rotation.inverse(np.array(bone.orientation)), direction)
    shape, centre = _shrink(bone.shape, local, depth)
    return dataclasses.replace(bone, shape=shape, position=bone.pose.apply(centre[None])[0])


def _shrink(shape: Shape, direction: np.ndarray, depth: float) -> tuple[Shape, np.ndarray]:
    """Shape after a cut by ``depth`` m on the side of a unit direction (3,), and its centre (3,) m,
    both in the frame of the given shape.
    """
    if isinstance(shape, Sphere):
        return Sphere(shape.radius - depth / 2), -direction * depth / 2
    if isinstance(shape, Box):
        axis = int(np.argmax(np.abs(direction)))
        cut = np.eye(3)[axis] * depth / abs(direction[axis])
        return Box(tuple(np.array(shape.size) - cut)), -np.sign(direction[axis]) * cut / 2
    across = float(np.hypot(*direction[:2]))
    if across < abs(direction[2]):
        cut = min(depth / abs(direction[2]), shape.length / 2)
        centre = np.array([0, 0, -np.sign(direction[2]) * cut / 2])
        return dataclasses.replace(shape, length=shape.length - cut), centre
    cut = min(depth / across, shape.radius / 2)
    return (dataclasses.replace(shape, radius=shape.radius - cut / 2),
            np.array([*(-direction[:2] / across), 0]) * cut / 2)
