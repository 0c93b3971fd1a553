"""A geom as a collision shape at its pose in the world."""
from __future__ import annotations

from ..collision.shapes import Shape, shape_at
from ..compiling.decorators import compiled
from ..dynamics.kinematics import Kinematics
from ..system import System


@compiled
def placed_shape(s: System, kin: Kinematics, k: int) -> Shape:
    """Geom k at its pose in ``kin``; after place_geoms()."""
    return shape_at(s, s.geoms[k], kin.geom_positions[k], kin.geom_rotations[k])
