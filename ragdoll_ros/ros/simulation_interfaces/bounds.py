"""Volumes around entities: their bounding boxes, and what overlaps a box or sphere."""
from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from ...model import rotation
from ...model.compound import Compound
from ...model.pose import Pose
from ...model.scene import Scene
from ...model.shapes import Shape
from ...model.state import State
from .codes import Code, Refusal
from .entities import Entity

Placed = tuple[Shape | Compound, Pose]


class Kind(IntEnum):
    """The standard's types of bounds."""

    EMPTY = 0
    BOX = 1
    CONVEX_HULL = 2
    SPHERE = 3


@dataclass(frozen=True)
class Volume:
    """A box by two corners, or a sphere by its centre and, as the first number of the second point,
    its radius; ``points`` (2, 3) m, world frame.

    of() raises Refusal for other kinds and other points.
    """

    kind: Kind
    points: np.ndarray

    @classmethod
    def of(cls, kind: int, points: Sequence[Sequence[float]]) -> Volume | None:
        """Make a volume of bounds in the world frame; None for EMPTY: unbounded. Raises Refusal for
        other kinds than BOX and SPHERE, and for wrong points.
        """
        if kind == Kind.EMPTY:
            return None
        if kind not in (Kind.BOX, Kind.SPHERE):
            raise Refusal(Code.FEATURE_UNSUPPORTED,
                          f'bounds.type: {kind}; expected 0 (empty), 1 (box) or 3 (sphere)')
        array = np.array(points, float)
        if array.shape != (2, 3) or not np.isfinite(array).all() or (
                kind == Kind.SPHERE and array[1, 0] < 0):
            raise Refusal(Code.OPERATION_FAILED, f'bounds.points: {len(points)} points; expected '
                          'two corners of a box, or the centre and the radius of a sphere')
        return cls(Kind(kind), array)

    def overlaps(self, shape: Shape | Compound, pose: Pose) -> bool:
        """Whether the volume overlaps a shape; of a box, whether it overlaps the shape's
        axis-aligned bounding box.
        """
        if self.kind == Kind.SPHERE:
            centre = pose.apply_inverse(self.points[:1])
            return bool(shape.signed_distance(centre)[0] <= self.points[1, 0])
        lower, upper = bounding_box([(shape, pose)])
        return bool((lower <= self.points.max(axis=0)).all()
                    and (upper >= self.points.min(axis=0)).all())

    def may_overlap(self, centres: np.ndarray, radii: np.ndarray) -> np.ndarray:
        """Whether the volume may overlap each sphere, (n,): a quick test. Spheres: (n,
        3), (n,) m.
        """
        if self.kind == Kind.SPHERE:
            return np.linalg.norm(centres - self.points[0], axis=1) <= radii + self.points[1, 0]
        lower, upper = self.points.min(axis=0), self.points.max(axis=0)
        beyond = np.maximum(np.maximum(lower - centres, centres - upper), 0)
        return np.linalg.norm(beyond, axis=1) <= radii


def overlapping(entities: Sequence[Entity], volume: Volume, scene: Scene,
                state: State) -> Iterator[Entity]:
    """Yield the entities of which a bone, or the shape of a static body, overlaps a volume."""
    radii = np.array([np.linalg.norm(bone.shape.half_extents) for bone in scene.bones])
    near = volume.may_overlap(state.positions, radii)
    for entity in entities:
        if entity.body is not None:
            found = volume.overlaps(entity.body.shape, entity.body.pose)
        else:
            bones = [bone for bone in entity.bones if near[bone]]
            found = any(volume.overlaps(scene.bones[bone].shape, state.poses(bone))
                        for bone in bones)
        if found:
            yield entity


def own_box(entity: Entity, scene: Scene, state: State) -> np.ndarray:
    """Lower and upper corner (2, 3) m of an entity in its own axes, about its own origin."""
    if entity.body is not None:
        return bounding_box([(entity.body.shape, Pose())])
    root = state.poses(entity.root)
    return bounding_box([(scene.bones[bone].shape, root.relative(state.poses(bone)))
                         for bone in entity.bones])


def bounding_box(placed: Sequence[Placed]) -> np.ndarray:
    """Lower and upper corner (2, 3) m of shapes at poses, by their support functions."""
    corners = []
    for shape, pose in placed:
        axes = rotation.rotate(rotation.inverse(pose.orientation), np.eye(3))
        corners.append((pose.position - shape.support(-axes), pose.position + shape.support(axes)))
    lower, upper = np.array(corners).swapaxes(0, 1)
    return np.array((lower.min(axis=0), upper.max(axis=0)))
