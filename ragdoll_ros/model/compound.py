"""A shape of several primitives, as a link of several collision elements in URDF and SDF."""
from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from . import errors, rotation
from .errors import set_fields
from .pose import Pose
from .rotation import IDENTITY
from .shapes import Part
from .vectors import Vector, floats, vector

TOLERANCE = 1e-5
"""Largest offset of the centre of mass over the largest half extent, and largest product of inertia
over the largest moment. Numbers of six digits meet it; the error of the motion is as small."""


@dataclass(frozen=True)
class Compound:
    """Primitive shapes fixed to each other. Uniform density; overlaps count twice.

    A Bone without ``moments`` requires the origin at the centre of mass, and principal axes of
    inertia as axes.

    Args:
        parts: Part objects, in the compound's axes. Raises WrongForm if there is none.

    Example:
        >>> dumbbell = Compound((Part(Sphere(0.1), (0, 0, 0.3)), Part(Sphere(0.1), (0, 0, -0.3))))
        >>> dumbbell.half_extents
        (0.1, 0.1, 0.4)
    """

    parts: tuple[Part, ...]
    kind: ClassVar[str] = 'compound'

    def __post_init__(self) -> None:
        set_fields(self, parts=tuple(self.parts))
        if not self.parts:
            raise errors.WrongForm('shapes', self.parts, 'at least one shape')

    @property
    def volume(self) -> float:
        """Sum over the parts, m^3."""
        return sum(part.shape.volume for part in self.parts)

    @property
    def centroid(self) -> np.ndarray:
        """Centre of mass (3,) m."""
        return self._mass_fractions() @ np.array([part.centroid for part in self.parts])

    @property
    def half_extents(self) -> Vector:
        """Half edges (3,) m of its bounding box centred at the origin."""
        return vector(np.maximum(self.support(np.eye(3)), self.support(-np.eye(3))))

    @property
    def support_terms(self) -> tuple[float, ...]:
        """Terms of support_distance() for its bounding box: an upper bound."""
        return (*self.half_extents, 0.0, 0.0, 0.0)

    @property
    def primitives(self) -> tuple[Part, ...]:
        """The primitives of all parts, to draw; hulls are kept as they are."""
        return tuple(Part.at(piece.shape, part.pose.compose(piece.pose))
                     for part in self.parts
                     for piece in part.shape.primitives or (Part(part.shape),))

    def support(self, direction: np.ndarray) -> np.ndarray:
        """Support function (...,) m along unit directions (..., 3): maximum over the parts."""
        direction = np.asarray(direction, float)
        return np.max([direction @ np.array(part.position) + part.shape.support(
            rotation.rotate(rotation.inverse(part.orientation), direction))
            for part in self.parts], axis=0)

    def inertia_matrix(self, mass: float) -> np.ndarray:
        """Inertia (3, 3) kg m^2 about the origin, by the parallel axis theorem."""
        total = np.zeros((3, 3))
        for part, share in zip(self.parts, mass * self._mass_fractions(), strict=True):
            axes, at = rotation.matrix(part.orientation), part.centroid
            total += part.shape.turned_inertia(share, axes)
            total += share * (at @ at * np.eye(3) - np.outer(at, at))
        return total

    def inertia(self, mass: float) -> Vector:
        """Moments (3,) kg m^2 about the axes through the origin."""
        return vector(np.diag(self.inertia_matrix(mass)))

    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        """Minimum of the parts' signed distances (p,) m at points (p, 3). Inside, its absolute
        value is a lower bound of the depth, unless a part is a hull: its distance is that from its
        bounding box.
        """
        return np.min([part.shape.signed_distance(part.pose.apply_inverse(points))
                       for part in self.parts], axis=0)

    def mesh(self) -> tuple[np.ndarray, np.ndarray]:
        """Vertices (p, 3) m and triangles (t, 3) of all parts."""
        meshes = [(part.pose.apply(vertices), triangles) for part in self.parts
                  for vertices, triangles in [part.shape.mesh()]]
        starts = itertools.accumulate((len(vertices) for vertices, _ in meshes), initial=0)
        return (np.concatenate([vertices for vertices, _ in meshes]),
                np.concatenate([triangles + start
                                for (_, triangles), start in zip(meshes, starts, strict=False)]))

    def principal_pose(self) -> Pose:
        """Centre of mass and principal axes, ordered to be nearest to the current axes."""
        return Pose(self.centroid, principal_axes(self.in_frame(Pose(self.centroid))
                                                  .inertia_matrix(1.0)))

    def in_frame(self, pose: Pose) -> Compound:
        """The same solid in the axes of the frame at ``pose``."""
        return Compound(tuple(Part.at(part.shape, pose.relative(part.pose)) for part in self.parts))

    def check_principal(self) -> None:
        """Raise OffCentre or NotPrincipal unless origin and axes are the principal ones."""
        centroid, size = self.centroid, max(self.half_extents)
        if not np.abs(centroid).max() <= TOLERANCE * size:
            raise errors.OffCentre('shapes', floats(centroid.round(9) + 0.0), (
                'their centre of mass at the origin: take this off every position, or give an '
                'inertia'))
        matrix = self.inertia_matrix(1.0)
        products = matrix[np.triu_indices(3, 1)]
        if not np.abs(products).max() <= TOLERANCE * matrix.diagonal().max():
            turn = floats(self.principal_pose().orientation.round(9) + 0.0)
            raise errors.NotPrincipal('shapes', floats(float(f'{x:.3g}') for x in products), (
                'no products of inertia xy, xz, yz for 1 kg, or an inertia given: the principal '
                f'axes are turned by {list(turn)}'))

    def _mass_fractions(self) -> np.ndarray:
        """Mass fraction (p,) of each part; they sum to 1."""
        volumes = np.array([part.shape.volume for part in self.parts])
        return volumes / volumes.sum()


def has_hull(shape: object) -> bool:
    """Whether a shape is a Compound of which a part is a hull."""
    return isinstance(shape, Compound) and any(part.kind == 'hull' for part in shape.parts)


def principal_axes(inertia: np.ndarray) -> np.ndarray:
    """Orientation (4,) of the principal axes of an inertia (3, 3), permuted and signed to be
    nearest to the current axes.
    """
    if np.abs(inertia[np.triu_indices(3, 1)]).max() <= 1e-12 * inertia.diagonal().max():
        return np.array(IDENTITY)
    _, vectors = np.linalg.eigh(inertia)
    order = max(itertools.permutations(range(3)),
                key=lambda order: np.abs(np.diag(vectors[:, order])).sum())
    axes = vectors[:, order]
    axes = axes * np.where(np.diag(axes) < 0, -1, 1)
    if np.linalg.det(axes) < 0:
        axes[:, np.argmin(np.abs(np.diag(axes)))] *= -1
    return rotation.from_matrix(axes)
