"""What to draw for a bone: boxes, cylinders and balls, which every viewer knows."""
from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from .ragdoll import Bone, Box, Capsule, Cylinder, Vector

PLAIN = (0.5, 0.64, 0.82, 1.0)
"""Red, green, blue, opacity of a bone that has no colour of its own."""


@dataclass(frozen=True)
class Part:
    """A box, cylinder (along z) or sphere of ``size`` m, ``shift`` m along the bone's axes."""

    kind: str
    size: Vector
    shift: Vector = (0.0, 0.0, 0.0)


def parts_of(bone: Bone) -> Iterator[Part]:
    """Parts that make up a bone's shape; a capsule is a cylinder between two balls."""
    shape = bone.shape
    if isinstance(shape, Box):
        yield Part('box', shape.size)
        return
    across = 2 * shape.radius
    if isinstance(shape, Cylinder | Capsule):
        yield Part('cylinder', (across, across, shape.length))
    if not isinstance(shape, Cylinder):
        half = shape.length / 2 if isinstance(shape, Capsule) else 0.0
        for end in (half, -half) if half else (0.0,):
            yield Part('sphere', (across,) * 3, (0.0, 0.0, end))
