"""StaticBody: what a scene has beside its dolls and the ground and never moves: a stair, a wall."""
import math
from dataclasses import dataclass

import numpy as np

from . import errors, rotation
from .compound import Compound
from .errors import set_fields
from .mesh import Surface
from .plane import Plane
from .pose import Pose
from .rotation import IDENTITY
from .shapes import Part, Shape, Solid
from .surface import check_stiffness, check_surface
from .vectors import Quaternion, Vector, finite_floats, unit_vector, vector

DEFAULT_COLOR = (0.76, 0.78, 0.81, 1.0)
"""Red, green, blue and opacity of bodies that have no colour: between the ground's and a doll's."""


@dataclass(frozen=True)
class StaticBody:
    """A shape at a fixed pose in the world frame.

    Args:
        name: unique among bodies and dolls of the scene.
        shape: a Sphere, Box, Cylinder, Capsule, a Compound of them, a HeightField, a Mesh or a
            Plane.
        position: (3,) m, of the shape's origin.
        orientation: quaternion x, y, z, w, shape's axes to world axes; normalised.
        friction: Coulomb's coefficient, 0 or more; None: that of the scene's material.
        rolling_friction: lever arm, m, 0 or more; None: that of the scene's material.
        restitution: 0 to 1; None: that of the scene's material.
        color: red, green, blue, opacity, 0 to 1; None: DEFAULT_COLOR.
        stiffness: N/m, as of the Ground; infinity: rigid.

    Raises:
        NotFinite, NotUnit, NotPositive, WrongForm, OutOfRange: for its fields.

    Example:
        >>> StaticBody('wall', Box((0.1, 2, 2)), position=(1, 0, 1), friction=0.5).shape.kind
        'box'
    """

    name: str
    shape: Shape | Compound | Surface | Plane
    position: Vector = (0.0, 0.0, 0.0)
    orientation: Quaternion = IDENTITY
    friction: float | None = None
    rolling_friction: float | None = None
    restitution: float | None = None
    color: tuple[float, float, float, float] | None = None
    stiffness: float = math.inf

    def __post_init__(self) -> None:
        set_fields(self, position=finite_floats('position', self.position),
                   orientation=unit_vector('orientation', self.orientation,
                                           'a quaternion x, y, z, w, not zero', 4))
        if not isinstance(self.shape, Solid | Compound | Surface | Plane):
            raise errors.WrongForm('shape', self.shape,
                                   'a shape, a Compound of shapes, a surface or a Plane')
        check_surface(self, max_rolling_friction=1e6)
        check_stiffness(self.stiffness)

    @property
    def pose(self) -> Pose:
        """Pose of its shape, world frame."""
        return Pose(np.array(self.position), np.array(self.orientation))

    @property
    def normal(self) -> Vector:
        """Its z axis (3,), world frame: of a Plane the normal."""
        return vector(rotation.rotate(self.orientation, np.array((0.0, 0.0, 1.0))))

    @property
    def parts(self) -> tuple[Part, ...]:
        """Its primitive shapes at their poses in the world frame."""
        return tuple(Part.at(part.shape, self.pose.compose(part.pose)) for part in self.shape.parts)

    @property
    def primitives(self) -> tuple[Part, ...]:
        """Primitive shapes to draw, at their poses in the world frame: boxes, cylinders, spheres,
        and the hulls of a Compound; none of a surface or a plane, which are drawn as meshes.
        """
        return tuple(Part.at(piece.shape, self.pose.compose(piece.pose))
                     for piece in self.shape.primitives)
