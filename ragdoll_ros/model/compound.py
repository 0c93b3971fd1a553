"""A bone of several shapes, as the several collision elements of a link in URDF and SDF."""
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
from .vectors import Vector, floats

TOLERANCE = 1e-5
"""Of the largest half extent, how far parts may be off their centre of mass, and of the largest
moment, what a product of inertia may be: numbers written with six digits keep to it, and what the
motion errs by it is as small."""


@dataclass(frozen=True)
class Compound:
    """Simple shapes fixed to each other: a uniform solid, in which what overlaps counts twice.

    It has the properties and methods of every Solid, in the axes that its ``parts`` are given in.
    Those of a bone are its principal axes through its centre of mass (see check_principal), unless
    the bone has an inertia of its own.
    """

    parts: tuple[Part, ...]
    kind: ClassVar[str] = 'compound'

    def __post_init__(self) -> None:
        set_fields(self, parts=tuple(self.parts))
        if not self.parts:
            raise errors.WrongForm('shapes', self.parts, 'at least one shape')

    @property
    def volume(self) -> float:
        """Sum of the parts', m^3."""
        return sum(part.shape.volume for part in self.parts)

    @property
    def centroid(self) -> np.ndarray:
        """Centre of mass (3,) m of the uniform solid."""
        return self._mass_fractions() @ np.array([part.position for part in self.parts])

    @property
    def half_extents(self) -> Vector:
        """Half edges, m, of the smallest box about the origin that holds it."""
        return floats(np.maximum(self.support(np.eye(3)), self.support(-np.eye(3))))

    @property
    def support_terms(self) -> tuple[float, ...]:
        """That of the box of its half extents: it reaches no farther."""
        return (*self.half_extents, 0.0, 0.0, 0.0)

    @property
    def primitives(self) -> tuple[Part, ...]:
        """What it is drawn as: the primitives of all its parts."""
        return tuple(Part(piece.shape, *part.pose.compose(piece.pose))
                     for part in self.parts for piece in part.shape.primitives)

    def support(self, direction: np.ndarray) -> np.ndarray:
        """How far (...,) m it extends along unit directions (..., 3): as its farthest part."""
        direction = np.asarray(direction, float)
        return np.max([direction @ np.array(part.position) + part.shape.support(
            rotation.rotate(rotation.inverse(part.orientation), direction))
            for part in self.parts], axis=0)

    def inertia_matrix(self, mass: float) -> np.ndarray:
        """Inertia (3, 3) kg m^2 about the origin: parts of one density, by Steiner's theorem."""
        total = np.zeros((3, 3))
        for part, share in zip(self.parts, mass * self._mass_fractions(), strict=True):
            axes, at = rotation.matrix(part.orientation), np.array(part.position)
            total += axes * part.shape.inertia(share) @ axes.T
            total += share * (at @ at * np.eye(3) - np.outer(at, at))
        return total

    def inertia(self, mass: float) -> Vector:
        """Moments about the origin's axes, kg m^2."""
        return floats(np.diag(self.inertia_matrix(mass)))

    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        """(p,) m of points (p, 3) from its surface; inside, no less deep than in some part."""
        return np.min([part.shape.signed_distance(part.pose.apply_inverse(points))
                       for part in self.parts], axis=0)

    def mesh(self) -> tuple[np.ndarray, np.ndarray]:
        """Corners (p, 3) m and triangles (t, 3) of all parts."""
        meshes = [(part.pose.apply(corners), triangles) for part in self.parts
                  for corners, triangles in [part.shape.mesh()]]
        starts = itertools.accumulate((len(corners) for corners, _ in meshes), initial=0)
        return (np.concatenate([corners for corners, _ in meshes]),
                np.concatenate([triangles + start
                                for (_, triangles), start in zip(meshes, starts, strict=False)]))

    def principal_pose(self) -> Pose:
        """Its centre of mass and its principal axes, those nearest to the axes it is given in."""
        return Pose(self.centroid, principal_axes(self.in_frame(Pose(self.centroid))
                                                  .inertia_matrix(1.0)))

    def in_frame(self, pose: Pose) -> Compound:
        """The same solid in the axes of a frame that stands at ``pose``."""
        return Compound(tuple(Part(part.shape, *pose.relative(part.pose)) for part in self.parts))

    def check_principal(self) -> None:
        """Raise unless its origin is its centre of mass and its axes are principal ones."""
        centroid, size = self.centroid, max(self.half_extents)
        if not np.abs(centroid).max() <= TOLERANCE * size:
            raise errors.OffCentre('shapes', floats(centroid.round(9) + 0.0), (
                'their centre of mass at the origin: take this off every position, or give an '
                'inertia'))
        matrix = self.inertia_matrix(1.0)
        products = matrix[np.triu_indices(3, 1)]
        if not np.abs(products).max() <= TOLERANCE * matrix.diagonal().max():
            turn = floats(self.principal_pose().orientation.round(9) + 0.0)
            raise errors.NotPrincipal('shapes', floats(f'{x:.3g}' for x in products), (
                'no products of inertia xy, xz, yz for 1 kg, or an inertia given: the principal '
                f'axes are turned by {list(turn)}'))

    def _mass_fractions(self) -> np.ndarray:
        """Share (p,) of each part in the mass."""
        volumes = np.array([part.shape.volume for part in self.parts])
        return volumes / volumes.sum()


def principal_axes(inertia: np.ndarray) -> np.ndarray:
    """Orientation (4,) of an inertia's (3, 3) principal axes: of all ways to name and direct them
    the one that is nearest to the axes that it is given in.
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
