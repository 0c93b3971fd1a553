"""Bodies from the links of a robot: shapes (also from meshes), mass and inertia.

The inertia is that of the link and of the links merged into it. It is omitted where it equals that
of a uniform solid of the shapes to 1e-6; a missing or unphysical inertia is replaced by that of the
solid.
"""
import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...files.robots.mesh_file import find_file, read_mesh
from ...files.robots.urdf_tree import UrdfLink, UrdfMesh
from ...model import errors, rotation
from ...model.compound import Compound, principal_axes
from ...model.pose import Pose
from ...model.ragdoll import Bone
from ...model.shapes import Box, Capsule, Part, Shape
from .mesh_shapes import fit_mesh

PlacedShape = tuple[Shape, Pose]
"""A shape and its pose."""

DEFAULT_DENSITY = 1000.0
"""kg/m^3 of a moving link with shapes but no mass."""

MIN_BOX_EDGE = 0.005
"""m; shortest edge of an equivalent box."""

ROUNDING = 1e-6
"""Relative rounding error of numbers with six digits."""


POINT = 1e-6
"""Share of a uniform solid's inertia below which one is that of a point: it gives a body a spin
that grows without an end."""

THINNEST = 1e-9
"""Least over largest moment of a body: a wire of 1 m and 0.05 mm. Rounding leaves less of zero."""


class LinkMeshes:
    """Meshes of a URDF in ``folder`` (None: unknown) as shapes; each file is fitted once."""

    def __init__(self, folder: Path | None) -> None:
        self._folder = folder
        self._fitted: dict[tuple, list[PlacedShape]] = {}

    def shapes(self, link: UrdfLink, notes: list[str]) -> list[PlacedShape]:
        """Shapes in the link's frame; a note reports each unreadable mesh."""
        found = []
        for mesh in link.meshes:
            try:
                found += [(shape, mesh.pose.compose(pose)) for shape, pose in self._fit(mesh)]
            except errors.Unreadable as error:
                notes.append(f'{link.name}: the mesh {mesh.file} is ignored: {error.value}; '
                             f'expected {error.expected}')
        return found

    def _fit(self, mesh: UrdfMesh) -> list[PlacedShape]:
        path = find_file(mesh.file, self._folder)
        if path is None:
            raise errors.Unreadable('', 'no such file', 'one beside the URDF or in a ROS package')
        key = path, mesh.scale
        if key not in self._fitted:
            self._fitted[key] = fit_mesh(read_mesh(path, mesh.scale))
        return self._fitted[key]


def link_shapes(link: UrdfLink, meshes: LinkMeshes, notes: list[str]) -> list[PlacedShape]:
    """Collision shapes of a link in its own frame; without any, a box of its mass and inertia if it
    has these, else none.
    """
    notes += [f'{link.name}: {what} is ignored' for what in link.left_out]
    shapes = [*_with_capsules(link.shapes), *meshes.shapes(link, notes)]
    if shapes or link.mass <= 0 or (link.inertia is None and not link.meshes):
        return shapes
    box = _equivalent_box(link)
    if box is not None:
        if link.meshes:
            notes.append(f'{link.name}: replaced by the box of the same inertia')
        return [box]
    if not link.meshes:
        return []
    notes.append(f'{link.name}: no body has its inertia: replaced by a cube of water')
    return [(Box(((link.mass / DEFAULT_DENSITY) ** (1 / 3),) * 3), link.centre)]


def make_bone(name: str, shapes: Sequence[PlacedShape], link: UrdfLink, frame: Pose,
              merged: Sequence[tuple[UrdfLink, Pose]], notes: list[str]) -> Bone:
    """Bone of a link with ``shapes`` and of the links merged into it, ``merged``, with poses.

    ``shapes`` are in the link's frame, ``frame`` and the poses in the doll's.
    """
    axes = Pose(orientation=frame.compose(link.centre).orientation)
    whole = Compound(tuple(Part(shape, *frame.compose(place)) for shape, place in shapes))
    mass = link.mass + sum(other.mass for other, _ in merged)
    if mass <= 0:
        mass = DEFAULT_DENSITY * whole.volume
        notes.append(f'{name} has no mass: {mass:.3g} kg are assumed, the mass of water')
    if len(shapes) == 1:
        bone = Bone(name, shapes[0][0], mass, *frame.compose(shapes[0][1]))
    else:
        pose = axes.compose(whole.in_frame(axes).principal_pose())
        bone = Bone(name, whole.in_frame(pose), mass, *pose)
    if _is_physical(link) and np.trace(link.inertia) > POINT * np.sum(bone.inertia):
        return _with_inertia(bone, whole, axes, *_combine_inertias([(link, frame), *merged]))
    if link.inertia is not None:
        notes.append(f'{name}: no body has its inertia: that of a uniform solid is used')
    return bone


def _with_inertia(bone: Bone, whole: Compound, axes: Pose, centre: np.ndarray,
                  inertia: np.ndarray) -> Bone:
    """The bone with its centre of mass at ``centre`` (3,) m and ``inertia`` (3, 3) about it.

    All in the doll's frame. The bone is unchanged where it has them; else its axes are the
    principal axes nearest to ``axes``.
    """
    near = ROUNDING * max(bone.shape.half_extents)
    same_centre = np.abs(centre - bone.position).max() < near
    found = _rotate_inertia(inertia, bone.orientation)
    if same_centre and np.abs(found - np.diag(bone.inertia)).max() < ROUNDING * found.max():
        return bone
    turn = principal_axes(_rotate_inertia(inertia, axes.orientation))
    pose = Pose(centre, rotation.multiply(axes.orientation, turn))
    moments = np.diag(_rotate_inertia(inertia, pose.orientation))
    if same_centre and rotation.angle_between(pose.orientation, bone.orientation) < ROUNDING:
        return dataclasses.replace(bone, moments=moments)
    return dataclasses.replace(bone, shape=whole.in_frame(pose), position=pose.position,
                               orientation=pose.orientation, moments=moments)


def _rotate_inertia(inertia: np.ndarray, orientation: np.ndarray) -> np.ndarray:
    """Inertia tensor (3, 3) expressed in the axes of an orientation (4,)."""
    turn = rotation.matrix(orientation)
    return turn.T @ inertia @ turn


def _combine_inertias(links: Sequence[tuple[UrdfLink, Pose]]) -> tuple[np.ndarray, np.ndarray]:
    """Centre of mass (3,) m of several links, and inertia (3, 3) kg m^2 about it; doll's axes."""
    masses = np.array([link.mass for link, _ in links])
    poses = [frame.compose(link.centre) for link, frame in links]
    places = np.array([pose.position for pose in poses])
    centre = masses @ places / masses.sum()
    total = np.zeros((3, 3))
    for (link, _), pose, arm in zip(links, poses, places - centre, strict=True):
        if _is_physical(link):
            total += _rotate_inertia(link.inertia, rotation.inverse(pose.orientation))
        total += link.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return centre, total


def _is_physical(link: UrdfLink) -> bool:
    """Whether a link has a physical inertia: positive, with the triangle inequality."""
    if link.inertia is None or link.mass <= 0:
        return False
    least, middle, most = np.linalg.eigvalsh(link.inertia)
    return bool(least > THINNEST * most and most <= (least + middle) * (1 + ROUNDING))


def _with_capsules(shapes: Sequence[PlacedShape]) -> list[PlacedShape]:
    """The shapes, with each cylinder that has a sphere at both ends replaced by a capsule."""
    spheres: set[int] = set()
    capsules: dict[int, PlacedShape] = {}
    for index, (cylinder, place) in enumerate(shapes):
        if cylinder.kind != 'cylinder':
            continue
        half = rotation.rotate(place.orientation, np.array([0, 0, cylinder.length / 2]))
        ends = [_sphere_at(shapes, place.position + end, cylinder, spheres)
                for end in (half, -half)]
        if None not in ends:
            spheres |= set(ends)
            capsules[index] = (Capsule(cylinder.radius, cylinder.length), place)
    return [capsules.get(index, placed) for index, placed in enumerate(shapes)
            if index not in spheres]


def _sphere_at(shapes: Sequence[PlacedShape], centre: np.ndarray, cylinder: Shape,
               taken: set[int]) -> int | None:
    """Index of a sphere with a cylinder's radius and its centre at the cylinder's end."""
    return next((index for index, (sphere, place) in enumerate(shapes)
                 if sphere.kind == 'sphere' and index not in taken
                 and abs(sphere.radius - cylinder.radius) <= 1e-9
                 and np.abs(place.position - centre).max() < 1e-6 * cylinder.length), None)


def _equivalent_box(link: UrdfLink) -> PlacedShape | None:
    """Uniform box of a link's mass and inertia: its edges a follow from a^2 = 6 (Iy + Iz - Ix) / m.

    Edges are at least MIN_BOX_EDGE. None without an inertia, where no edge is longer, or for a
    density below water / 50 or above 20 times water.
    """
    if link.inertia is None:
        return None
    moments, axes = np.linalg.eigh(link.inertia)
    squares = 6 * (moments.sum() - 2 * moments) / link.mass
    if not np.isfinite(squares).all() or squares.max() <= MIN_BOX_EDGE ** 2:
        return None
    if np.linalg.det(axes) < 0:
        axes = axes * (1, 1, -1)
    box = Box(tuple(np.sqrt(np.maximum(squares, MIN_BOX_EDGE ** 2))))
    if not DEFAULT_DENSITY / 50 < link.mass / box.volume < DEFAULT_DENSITY * 20:
        return None
    return box, link.centre.compose(Pose(orientation=rotation.from_matrix(axes)))
