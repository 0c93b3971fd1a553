"""Surfaces of triangles: a mesh and a height field, for static bodies; a hull, which may move."""
from __future__ import annotations

import dataclasses
import functools
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from . import errors
from .errors import set_fields
from .pose import Pose
from .rotation import IDENTITY
from .shapes import Box, Part, Solid
from .vectors import Vector, finite_floats, vector

MAX_TRIANGLES = 1_000_000

THINNEST = 1e-6
"""Height of a triangle over its longest edge from which on it has a normal."""

CONVEX = 1e-6
"""How far a vertex of a hull may be outside a face, over the hull's size: rounding of its file."""

OPEN = 1e9
"""`Triangles.edges` where there is no next triangle."""


@dataclass(frozen=True)
class Triangles:
    """The triangles of a surface, with normals and the angles at their edges.

    ``corners`` (t, 3, 3) m, anticlockwise about the normal; ``normals`` (t, 3); ``edges`` (t, 3):
    tangent of half the angle by which the surface bends down at the edge from corner k to k + 1,
    negative where it bends up; OPEN where the edge does not have exactly one neighbour, where that
    has the opposite orientation, or where the surface is folded back.
    """

    corners: np.ndarray
    normals: np.ndarray
    edges: np.ndarray


class Surface:
    """Base of the surfaces."""

    kind: ClassVar[str]
    parts: ClassVar[tuple] = ()
    """It has no solid parts."""
    primitives: ClassVar[tuple] = ()

    def mesh(self) -> tuple[np.ndarray, np.ndarray]:
        """Vertices (v, 3) m and triangles (t, 3)."""
        raise NotImplementedError

    @functools.cached_property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner (3,) m of its bounding box, in its own axes."""
        vertices, _ = self.mesh()
        return _frozen(vertices.min(axis=0)), _frozen(vertices.max(axis=0))

    def support(self, direction: np.ndarray) -> np.ndarray:
        """Support function (...,) m along unit directions (..., 3), in its own axes."""
        return (np.asarray(direction, float) @ self.mesh()[0].T).max(axis=-1)

    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        """Signed distance (p,) m of points (p, 3) from its bounding box, negative inside: a lower
        bound of the distance from the surface.
        """
        lower, upper = self.bounds
        beyond = np.maximum(lower - points, points - upper)
        return np.linalg.norm(np.maximum(beyond, 0), axis=1) + np.minimum(beyond.max(axis=1), 0)

    @functools.cached_property
    def triangles(self) -> Triangles:
        """Its triangles, in its own axes; those without a normal are left out."""
        return connected(*self.mesh())

    @functools.cached_property
    def _digest(self) -> bytes:
        raise NotImplementedError

    def __eq__(self, other: object) -> bool:
        return (isinstance(other, Surface) and type(self) is type(other)
                and self._digest == other._digest)

    def __hash__(self) -> int:
        return hash(self._digest)


@dataclass(frozen=True, eq=False)
class Mesh(Surface):
    """A surface of triangles. Raises WrongForm, NotFinite, OutOfRange.

    Args:
        vertices: (v, 3) m.
        faces: (t, 3) indices of the vertices, anticlockwise seen from outside.
        source: the file that it is from and the scale along its axes, if any.

    Example:
        >>> Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]).triangles.corners.shape
        (1, 3, 3)
    """

    vertices: np.ndarray
    faces: np.ndarray
    source: tuple | None = None
    kind: ClassVar[str] = 'mesh'

    def __post_init__(self) -> None:
        vertices = _array('mesh.vertices', self.vertices, 2, 'rows of three numbers, m')
        faces = _array('mesh.faces', self.faces, 2, 'rows of three indices of vertices')
        for path, rows, form in (('mesh.vertices', vertices, 'rows of three numbers, m'),
                                 ('mesh.faces', faces, 'rows of three indices of vertices')):
            if rows.shape[1] != 3:
                raise errors.WrongForm(path, rows[0].tolist(), form)
        if len(faces) > MAX_TRIANGLES:
            raise errors.OutOfRange('mesh.faces', len(faces), f'at most {MAX_TRIANGLES}')
        wrong = (faces < 0) | (faces >= len(vertices)) | (faces % 1 != 0)
        if wrong.any():
            row = int(np.flatnonzero(wrong.any(axis=1))[0])
            raise errors.OutOfRange(f'mesh.faces[{row}]', faces[row].tolist(),
                                    f'indices from 0 to {len(vertices) - 1}')
        set_fields(self, vertices=_frozen(vertices), faces=_frozen(faces.astype(np.int64)))
        if not len(self.triangles.corners):
            raise errors.WrongForm('mesh', f'{len(faces)} triangles', 'one that has an area')

    def mesh(self) -> tuple[np.ndarray, np.ndarray]:
        """Vertices (v, 3) m and triangles (t, 3)."""
        return self.vertices, self.faces

    def scaled(self, factors: Sequence[float]) -> Mesh:
        """Scaled by factors (3,), each above 0, along its own axes."""
        source = self.source and (self.source[0], vector(np.multiply(self.source[1], factors)))
        return dataclasses.replace(self, vertices=self.vertices * factors, source=source)

    @functools.cached_property
    def _digest(self) -> bytes:
        return _digest(self.vertices, self.faces, self.source)


@dataclass(frozen=True, eq=False)
class Hull(Mesh, Solid):
    """A convex polyhedron. As a part of a Compound it has uniform density and may move.

    Raises WrongForm where a vertex is outside a face or the surface is not closed.

    Args:
        vertices, faces, source: as of a Mesh; the surface must be closed.

    Example:
        >>> tetrahedron = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
        >>> Hull(tetrahedron, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]).kind
        'hull'
    """

    kind: ClassVar[str] = 'hull'

    def __post_init__(self) -> None:
        super().__post_init__()
        triangles, size = self.triangles, float(np.ptp(self.vertices, axis=0).max())
        offsets = np.einsum('ti,ti->t', triangles.normals, triangles.corners[:, 0])
        # In parts: of many vertices and faces all products do not fit into memory.
        for normals, offset in zip(np.array_split(triangles.normals, 1 + len(offsets) // 1000),
                                   np.array_split(offsets, 1 + len(offsets) // 1000), strict=True):
            outside = float((self.vertices @ normals.T - offset).max(initial=0.0))
            if outside > CONVEX * size:
                raise errors.WrongForm('hull', f'a vertex {outside:.3g} m outside a face',
                                       'a convex surface, its faces anticlockwise from outside')
        if (triangles.edges == OPEN).any():
            raise errors.WrongForm('hull', 'an edge without a second face', 'a closed surface')

    @property
    def volume(self) -> float:
        """m^3."""
        return self._mass_integrals[0]

    @property
    def centroid(self) -> Vector:
        """Its centre of mass (3,) m."""
        return self._mass_integrals[1]

    @property
    def half_extents(self) -> Vector:
        """Half edges (3,) m of its bounding box centred at the origin."""
        return vector(np.abs(self.bounds).max(axis=0))

    @property
    def support_terms(self) -> tuple[float, ...]:
        """Terms of support_distance() for its bounding box: an upper bound."""
        return (*self.half_extents, 0.0, 0.0, 0.0)

    def turned_inertia(self, mass: float, axes: np.ndarray) -> np.ndarray:
        """Inertia (3, 3) kg m^2 about its centre of mass, in the frame in which its own axes are
        the columns of ``axes`` (3, 3).
        """
        return mass * (axes @ self._mass_integrals[2] @ axes.T)

    @functools.cached_property
    def _mass_integrals(self) -> tuple[float, Vector, np.ndarray]:
        """Volume, m^3; centre of mass (3,) m; inertia (3, 3) m^2 of 1 kg about it.

        Sums over the tetrahedra between a point within and each triangle. Of one with the corners
        0, a, b, c the integral of x x^T is det(a, b, c) (s s^T + a a^T + b b^T + c c^T) / 120,
        s = a + b + c: Blow and Binstock, How to find the inertia tensor, 2004.
        """
        corners = self.triangles.corners
        within = corners.mean(axis=(0, 1))
        arms = corners - within
        sums, dets = arms.sum(axis=1), np.linalg.det(arms)
        volume = dets.sum() / 6
        center = (dets @ sums) / 24 / volume
        squares = (np.einsum('t,ti,tj->ij', dets, sums, sums)
                   + np.einsum('t,tki,tkj->ij', dets, arms, arms)) / 120 / volume
        squares -= np.outer(center, center)
        return (float(volume), vector(within + center),
                _frozen(np.trace(squares) * np.eye(3) - squares))


@dataclass(frozen=True, eq=False)
class HeightField(Surface):
    """Heights over a rectangular grid, its middle at the origin; each cell is two triangles.

    Raises WrongForm, NotFinite, NotPositive, OutOfRange.

    Args:
        heights: (rows, columns) m, 2 or more of each; rows along y, columns along x.
        size: (2,) m along x and y, from the first to the last column and row.
        source: the file that they are from, and their scale, if any.

    Example:
        >>> HeightField([[0, 0], [0, 1]], size=(2, 2)).mesh()[0][3].tolist()
        [1.0, 1.0, 1.0]
    """

    heights: np.ndarray
    size: tuple[float, float]
    source: tuple | None = None
    kind: ClassVar[str] = 'height_field'

    def __post_init__(self) -> None:
        heights = _array('height_field.heights', self.heights, 2, 'rows of heights, m')
        if min(heights.shape) < 2:
            raise errors.WrongForm('height_field.heights', list(heights.shape),
                                   'at least 2 rows of 2 heights, m')
        if 2 * (heights.shape[0] - 1) * (heights.shape[1] - 1) > MAX_TRIANGLES:
            raise errors.OutOfRange('height_field.heights', list(heights.shape),
                                    f'at most {MAX_TRIANGLES // 2} cells')
        size = finite_floats('height_field.size', self.size, 2)
        errors.check_positive('height_field.size', size)
        set_fields(self, heights=_frozen(heights), size=size)

    def mesh(self) -> tuple[np.ndarray, np.ndarray]:
        """Vertices (v, 3) m and triangles (t, 3)."""
        rows, columns = self.heights.shape
        x, y = np.meshgrid(np.linspace(-0.5, 0.5, columns) * self.size[0],
                           np.linspace(-0.5, 0.5, rows) * self.size[1])
        index = np.arange(rows * columns).reshape(rows, columns)
        a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
        faces = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], axis=2)
        return (np.stack([x, y, self.heights], axis=-1).reshape(-1, 3), faces.reshape(-1, 3))

    def scaled(self, factors: Sequence[float]) -> HeightField:
        """Scaled by factors (3,), each above 0, along its own axes."""
        x, y, z = (float(factor) for factor in factors)
        source = self.source and (self.source[0], self.source[1] * z)
        return HeightField(self.heights * z, (self.size[0] * x, self.size[1] * y), source)

    @functools.cached_property
    def _digest(self) -> bytes:
        return _digest(self.heights, self.size, self.source)


def boxed(part: Part) -> Part:
    """A part, or in place of a hull the box around it: for formats that have no hulls."""
    shape: object = part.shape
    if not isinstance(shape, Hull):
        return part
    lower, upper = shape.bounds
    return Part.at(Box(vector(upper - lower)),
                   part.pose.compose(Pose((lower + upper) / 2, np.array(IDENTITY))))


SURFACES: dict[str, type] = {surface.kind: surface for surface in (HeightField, Mesh, Hull)}


def connected(vertices: np.ndarray, faces: np.ndarray) -> Triangles:
    """The Triangles of a mesh; vertices at the same place are one."""
    _, place = np.unique(vertices, axis=0, return_inverse=True)
    corners = vertices[faces]
    sides = np.roll(corners, -1, axis=1) - corners
    normals = np.cross(sides[:, 0], sides[:, 1])
    twice_area, longest = (np.linalg.norm(normals, axis=1),
                           np.linalg.norm(sides, axis=2).max(axis=1, initial=0.0))
    kept = twice_area > THINNEST * longest ** 2
    faces, corners, sides = place.reshape(-1)[faces[kept]], corners[kept], sides[kept]
    normals = normals[kept] / twice_area[kept, None]
    # Each edge, from the lower vertex to the higher; the two triangles of one are adjacent then.
    begin, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    key = np.minimum(begin, end) * (len(vertices) + 1) + np.maximum(begin, end)
    order = np.argsort(key, kind='stable')
    key, edges = key[order], np.full(len(order), OPEN)
    first = np.flatnonzero(key[1:] == key[:-1])
    # An edge of three triangles or more, or of two that are turned against each other, stays open.
    count = np.bincount(np.unique(key, return_inverse=True)[1].reshape(-1))
    single = np.repeat(count == 2, count)[first]
    one, other = order[first[single]], order[first[single] + 1]
    opposite = begin[one] != begin[other]
    one, other = one[opposite], other[opposite]
    across = np.cross(sides.reshape(-1, 3), normals.repeat(3, axis=0))
    across /= np.linalg.norm(across, axis=1)[:, None]
    for here, there in ((one, other), (other, one)):
        sine = np.einsum('ij,ij->i', normals[there // 3], across[here])
        cosine = np.einsum('ij,ij->i', normals[there // 3], normals[here // 3])
        with np.errstate(divide='ignore', invalid='ignore'):
            edges[here] = np.where(1 + cosine > 1e-12, sine / (1 + cosine), OPEN)
    return Triangles(_frozen(corners), _frozen(normals), _frozen(edges.reshape(-1, 3)))


def _array(path: str, value: object, dimensions: int, form: str) -> np.ndarray:
    """Convert to an array (r, c) of finite floats. Raises WrongForm, or NotFinite for the first
    number that is not finite, with its row and column in the path.
    """
    try:
        array = np.array(value, float)
    except (TypeError, ValueError):
        array = np.zeros(0)
    if array.ndim != dimensions or not array.size:
        raise errors.WrongForm(path, str(value)[:60], form)
    broken = ~np.isfinite(array)
    if broken.any():
        row, column = np.argwhere(broken)[0].tolist()
        raise errors.NotFinite(f'{path}[{row}][{column}]', float(array[row, column]),
                               'a finite number')
    return array


def _frozen(array: np.ndarray) -> np.ndarray:
    array.setflags(write=False)
    return array


def _digest(*parts: object) -> bytes:
    found = hashlib.sha256()
    for part in parts:
        found.update(part.tobytes() + repr(part.shape).encode() if isinstance(part, np.ndarray)
                     else repr(part).encode())
    return found.digest()
