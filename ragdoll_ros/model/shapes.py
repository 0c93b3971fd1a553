"""Primitive shapes of bones: sphere, box, cylinder, capsule. Uniform solids in their own axes, m.

A bone of several shapes has a Compound (compound.py), of which some may be hulls (mesh.py).
"""
from __future__ import annotations

import dataclasses
import functools
import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from . import errors
from .errors import set_fields
from .pose import Pose
from .rotation import IDENTITY
from .vectors import Quaternion, Vector, finite_floats, unit_vector, vector

SEGMENTS = 20
"""Vertices of a circle in a mesh."""


class Solid:
    """Base of the primitive shapes; a Compound has the same properties and methods, except
    turned_inertia().

    Each shape defines, in its own axes:
    - ``volume``, m^3, and ``half_extents``, m, half the edges of its bounding box
    - ``support_terms``: six terms, m, of its support function; see support_distance
    - ``inertia(mass)``: principal moments of the uniform solid about its centre, kg m^2
    - ``signed_distance(points)``: (p,) m of points (p, 3) from its surface, negative inside
    - ``mesh()``: vertices (p, 3) m, triangles (t, 3), counter-clockwise seen from outside
    """

    kind: ClassVar[str]
    support_terms: property

    @property
    def centroid(self) -> Vector:
        """Its centre of mass (3,) m, in its own axes."""
        return (0.0, 0.0, 0.0)

    def inertia(self, mass: float) -> Vector:
        """Principal moments (3,) kg m^2."""
        raise NotImplementedError

    def turned_inertia(self, mass: float, axes: np.ndarray) -> np.ndarray:
        """Inertia (3, 3) kg m^2 about its centre of mass, in the frame in which its own axes are
        the columns of ``axes`` (3, 3).
        """
        return axes * self.inertia(mass) @ axes.T

    @property
    def parts(self) -> tuple[Part, ...]:
        """The shapes that collide: itself alone."""
        return _as_parts(self)

    @property
    def primitives(self) -> tuple[Part, ...]:
        """Boxes, cylinders and spheres to draw: every viewer has these."""
        return _as_parts(self)

    def support(self, direction: np.ndarray) -> np.ndarray:
        """Support function (...,) m: its extent along unit directions (..., 3) in its own axes."""
        return support_distance(np.array(self.support_terms), np.asarray(direction, float))


@dataclass(frozen=True)
class Part:
    """A primitive shape of a Compound at a pose. Raises WrongForm, NotFinite, NotUnit.

    Args:
        shape: a Sphere, Box, Cylinder, Capsule or Hull.
        position: (3,) m, its centre; of a Hull its origin.
        orientation: quaternion x, y, z, w, part's axes to compound's axes; normalised.

    Example:
        >>> Part(Sphere(0.1), position=(0, 0, 0.2)).size
        (0.2, 0.2, 0.2)
    """

    shape: Shape
    position: Vector = (0.0, 0.0, 0.0)
    orientation: Quaternion = IDENTITY

    def __post_init__(self) -> None:
        set_fields(self, position=finite_floats('position', self.position),
                   orientation=unit_vector('orientation', self.orientation, count=4))
        if not isinstance(self.shape, Solid):
            raise errors.WrongForm('shape', self.shape, 'one of ' + ', '.join((*SHAPES, 'hull')))

    @classmethod
    def at(cls, shape: Shape, pose: Pose) -> Part:
        """A shape at a pose in the compound's axes."""
        x, y, z, w = map(float, pose.orientation)
        return cls(shape, vector(pose.position), (x, y, z, w))

    @property
    def is_centred(self) -> bool:
        """Whether its pose is the identity."""
        return not any(self.position) and self.orientation == IDENTITY

    @property
    def kind(self) -> str:
        """Its shape's kind."""
        return self.shape.kind

    @property
    def centroid(self) -> np.ndarray:
        """Its centre of mass (3,) m, in the compound's axes."""
        if not any(self.shape.centroid):
            return np.array(self.position)
        return self.pose.apply(np.array(self.shape.centroid))

    @property
    def size(self) -> Vector:
        """(3,) m, edges of its shape's bounding box, in the shape's axes and centred at
        its origin.
        """
        return vector(2 * half for half in self.shape.half_extents)

    @property
    def pose(self) -> Pose:
        """Pose in the compound's axes."""
        return Pose(np.array(self.position), np.array(self.orientation))


@functools.lru_cache(4096)
def _as_parts(shape: Shape) -> tuple[Part, ...]:
    """A shape as its only part. Cached: a batch of simulations asks for the same shapes
    many times.
    """
    return (Part(shape),)


@dataclass(frozen=True)
class Sphere(Solid):
    """A solid sphere. Raises NotPositive, NotFinite.

    Args:
        radius: m.

    Example:
        >>> round(Sphere(0.1).volume, 6)
        0.004189
    """

    radius: float
    kind: ClassVar[str] = 'sphere'

    def __post_init__(self) -> None:
        set_fields(self, radius=float(self.radius))
        errors.check_positive('sphere', self.radius)

    @property
    def volume(self) -> float:
        return 4 / 3 * math.pi * self.radius ** 3

    @property
    def half_extents(self) -> Vector:
        return (self.radius,) * 3

    @property
    def support_terms(self) -> tuple[float, ...]:
        return (0.0, 0.0, 0.0, 0.0, self.radius, 0.0)

    def inertia(self, mass: float) -> Vector:
        return (0.4 * mass * self.radius ** 2,) * 3

    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        return np.linalg.norm(points, axis=1) - self.radius

    def mesh(self) -> tuple[np.ndarray, np.ndarray]:
        angles = _half_circle()
        return _revolved(self.radius * np.cos(angles), self.radius * np.sin(angles))


@dataclass(frozen=True)
class Box(Solid):
    """A solid box. Raises NotPositive, NotFinite, WrongForm.

    Args:
        size: (3,) m, full edges along its x, y and z.

    Example:
        >>> Box((0.2, 0.3, 0.5)).half_extents
        (0.1, 0.15, 0.25)
    """

    size: Vector
    kind: ClassVar[str] = 'box'

    def __post_init__(self) -> None:
        set_fields(self, size=finite_floats('box', self.size))
        errors.check_positive('box', self.size)

    @property
    def volume(self) -> float:
        return math.prod(self.size)

    @property
    def half_extents(self) -> Vector:
        return vector(edge / 2 for edge in self.size)

    @property
    def support_terms(self) -> tuple[float, ...]:
        return (*self.half_extents, 0.0, 0.0, 0.0)

    def inertia(self, mass: float) -> Vector:
        xx, yy, zz = (edge * edge for edge in self.size)
        return (mass * (yy + zz) / 12, mass * (xx + zz) / 12, mass * (xx + yy) / 12)

    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        return _beyond_faces(np.abs(points) - np.array(self.half_extents))

    def mesh(self) -> tuple[np.ndarray, np.ndarray]:
        signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        quads = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4],
                          [1, 5, 7, 3]])
        triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
        return signs * np.array(self.half_extents), triangles


@dataclass(frozen=True)
class Cylinder(Solid):
    """A solid cylinder along its own z. Raises NotPositive, NotFinite.

    Args:
        radius, length: m; the length is from face to face.

    Example:
        >>> Cylinder(radius=0.1, length=0.4).half_extents
        (0.1, 0.1, 0.2)
    """

    radius: float
    length: float
    kind: ClassVar[str] = 'cylinder'

    def __post_init__(self) -> None:
        set_fields(self, radius=float(self.radius), length=float(self.length))
        errors.check_positive('cylinder', (self.radius, self.length))

    @property
    def volume(self) -> float:
        return math.pi * self.radius ** 2 * self.length

    @property
    def half_extents(self) -> Vector:
        return (self.radius, self.radius, self.length / 2)

    @property
    def support_terms(self) -> tuple[float, ...]:
        return (0.0, 0.0, 0.0, self.length / 2, 0.0, self.radius)

    def inertia(self, mass: float) -> Vector:
        across = mass * (3 * self.radius ** 2 + self.length ** 2) / 12
        return (across, across, mass * self.radius ** 2 / 2)

    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        return _beyond_faces(np.stack([np.linalg.norm(points[:, :2], axis=1) - self.radius,
                                       np.abs(points[:, 2]) - self.length / 2], axis=1))

    def mesh(self) -> tuple[np.ndarray, np.ndarray]:
        radii = np.array([0, self.radius, self.radius, 0])
        return _revolved(radii, np.array([-1, -1, 1, 1]) * self.length / 2)


@dataclass(frozen=True)
class Capsule(Solid):
    """A solid cylinder along its own z with hemispheres. Raises NotPositive, NotFinite.

    Args:
        radius: m.
        length: m, of the cylinder; the whole is length + 2 radius long, as in MuJoCo and SDF.

    Example:
        >>> Capsule(radius=0.125, length=0.5).half_extents
        (0.125, 0.125, 0.375)
    """

    radius: float
    length: float
    kind: ClassVar[str] = 'capsule'

    def __post_init__(self) -> None:
        set_fields(self, radius=float(self.radius), length=float(self.length))
        errors.check_positive('capsule', (self.radius, self.length))

    @property
    def volume(self) -> float:
        return math.pi * self.radius ** 2 * (self.length + 4 / 3 * self.radius)

    @property
    def half_extents(self) -> Vector:
        return (self.radius, self.radius, self.length / 2 + self.radius)

    @property
    def support_terms(self) -> tuple[float, ...]:
        return (0.0, 0.0, 0.0, self.length / 2, self.radius, 0.0)

    @property
    def primitives(self) -> tuple[Part, ...]:
        """A cylinder and two spheres."""
        end = self.length / 2
        return (Part(Cylinder(self.radius, self.length)),
                *(Part(Sphere(self.radius), (0.0, 0.0, z)) for z in (end, -end)))

    def inertia(self, mass: float) -> Vector:
        """Principal moments of the uniform solid about its centre, kg m^2.

        Those of a cylinder and two hemispheres, each moved to the cylinder's end by the parallel
        axis theorem (its centre of mass is 3/8 r from its face).
        """
        r, length = self.radius, self.length
        barrel = mass * length / (length + 4 / 3 * r)
        balls = mass - barrel
        along = barrel * r * r / 2 + balls * 0.4 * r * r
        across = (barrel * (3 * r * r + length * length) / 12
                  + balls * (0.4 * r * r + length * length / 4 + 3 / 8 * length * r))
        return (across, across, along)

    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        along = np.maximum(np.abs(points[:, 2]) - self.length / 2, 0)
        return np.hypot(np.linalg.norm(points[:, :2], axis=1), along) - self.radius

    def mesh(self) -> tuple[np.ndarray, np.ndarray]:
        angles = _half_circle()
        heights = self.radius * np.sin(angles)
        return _revolved(self.radius * np.cos(angles),
                         heights + np.where(angles < 0, -1, 1) * self.length / 2)


Shape = Sphere | Box | Cylinder | Capsule
SHAPES: dict[str, type] = {shape.kind: shape for shape in (Sphere, Box, Cylinder, Capsule)}
SIZES = {kind: tuple(field.name for field in dataclasses.fields(shape))
         for kind, shape in SHAPES.items()}
"""Names of each kind's sizes."""


def support_distance(terms: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Support function (...,) m of shapes along unit directions (..., 3) in their own axes.

    ``terms`` (..., 6) m: half edges along x, y and z; half length of the axis along z; radius of
    the sphere swept along it; radius of the disc across it.
    """
    cosines = np.abs(direction)
    sines = np.sqrt(np.maximum(0, 1 - cosines[..., 2] ** 2))
    edges, along, sphere, disc = (terms[..., :3], terms[..., 3], terms[..., 4], terms[..., 5])
    return (edges * cosines).sum(axis=-1) + along * cosines[..., 2] + sphere + disc * sines


def _beyond_faces(beyond: np.ndarray) -> np.ndarray:
    """Signed distance (p,) m, given the distances (p, k) beyond k pairs of faces."""
    inside = np.minimum(beyond.max(axis=1), 0)
    return np.linalg.norm(np.maximum(beyond, 0), axis=1) + inside


def _half_circle() -> np.ndarray:
    return np.linspace(-np.pi / 2, np.pi / 2, SEGMENTS // 2)


def _revolved(radii: np.ndarray, heights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mesh of the surface of revolution of a profile about z, from bottom to top."""
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
