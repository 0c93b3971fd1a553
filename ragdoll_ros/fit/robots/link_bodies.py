"""Bodies of a robot's links: what shapes a link has, and the bone that they and its inertia make.

Its inertia, with that of the links that it carries, is the bone's own where it is not that of a
uniform solid of its shapes to 1e-6; where none is given, or one that no body can have, the bone is
that solid.
"""
from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from ...files.urdf_tree import UrdfLink
from ...model import rotation
from ...model.compound import Compound, principal_axes
from ...model.pose import Pose
from ...model.ragdoll import Bone
from ...model.shapes import Box, Capsule, Part, Shape
from .link_meshes import LinkMeshes, Placed

DENSITY = 1000.0
"""kg/m^3 of a link that moves and has a shape but no mass."""

THINNEST = 0.005
"""m; of a body that only its inertia makes."""

ROUNDING = 1e-6
"""What numbers of six digits differ by."""

def link_shapes(link: UrdfLink, meshes: LinkMeshes, notes: list[str]) -> list[Placed]:
    """What a link is for contact, its shapes in its own frame; none if nothing gives any."""
    notes += [f'{link.name}: {what} is left out' for what in link.left_out]
    shapes = [*_with_capsules(link.shapes), *meshes.shapes(link, notes)]
    if shapes or link.mass <= 0 or (link.inertia is None and not link.meshes):
        return shapes
    box = _same_inertia(link)
    if box is not None:
        if link.meshes:
            notes.append(f'{link.name}: the box of the same inertia is taken')
        return [box]
    if not link.meshes:
        return []
    notes.append(f'{link.name}: no inertia that could be; a cube of water is taken')
    return [(Box(((link.mass / DENSITY) ** (1 / 3),) * 3), link.centre)]


def make_bone(name: str, shapes: Sequence[Placed], link: UrdfLink, frame: Pose,
              carried: Sequence[tuple[UrdfLink, Pose]], notes: list[str]) -> Bone:
    """Bone of a link with ``shapes`` and of what it carries, each link with its frame's pose.

    ``shapes`` are in the link's own frame, ``frame`` and the others in the doll's.
    """
    axes = Pose(orientation=frame.compose(link.centre).orientation)
    whole = Compound(tuple(Part(shape, *frame.compose(place)) for shape, place in shapes))
    mass = link.mass + sum(other.mass for other, _ in carried)
    if mass <= 0:
        mass = DENSITY * whole.volume
        notes.append(f'{name} has no mass: that of water is taken, {mass:.3g} kg')
    if len(shapes) == 1:
        bone = Bone(name, shapes[0][0], mass, *frame.compose(shapes[0][1]))
    else:
        pose = axes.compose(whole.in_frame(axes).principal_pose())
        bone = Bone(name, whole.in_frame(pose), mass, *pose)
    if _is_possible(link):
        return _with_inertia(bone, whole, axes, *_combined([(link, frame), *carried]))
    if link.inertia is not None:
        notes.append(f'{name}: no body has its inertia: that of a uniform solid is taken')
    return bone


def _with_inertia(bone: Bone, whole: Compound, axes: Pose, centre: np.ndarray,
                  inertia: np.ndarray) -> Bone:
    """The bone, but with its centre of mass at ``centre`` (3,) m and ``inertia`` (3, 3) about it.

    All in the doll's frame. The bone as it is where it has them; else along those principal axes
    that are nearest to ``axes``.
    """
    near = ROUNDING * max(bone.shape.half_extents)
    stays = np.abs(centre - bone.position).max() < near
    found = _turned(inertia, bone.orientation)
    if stays and np.abs(found - np.diag(bone.inertia)).max() < ROUNDING * found.max():
        return bone
    turn = principal_axes(_turned(inertia, axes.orientation))
    pose = Pose(centre, rotation.multiply(axes.orientation, turn))
    moments = np.diag(_turned(inertia, pose.orientation))
    if stays and rotation.angle_between(pose.orientation, bone.orientation) < ROUNDING:
        return dataclasses.replace(bone, moments=moments)
    return dataclasses.replace(bone, shape=whole.in_frame(pose), position=pose.position,
                               orientation=pose.orientation, moments=moments)


def _turned(inertia: np.ndarray, orientation: np.ndarray) -> np.ndarray:
    """An inertia (3, 3) in the axes of an orientation (4,)."""
    turn = rotation.matrix(orientation)
    return turn.T @ inertia @ turn


def _combined(links: Sequence[tuple[UrdfLink, Pose]]) -> tuple[np.ndarray, np.ndarray]:
    """Centre of mass (3,) m of several links, and inertia (3, 3) kg m^2 about it, doll's axes."""
    masses = np.array([link.mass for link, _ in links])
    poses = [frame.compose(link.centre) for link, frame in links]
    places = np.array([pose.position for pose in poses])
    centre = masses @ places / masses.sum()
    total = np.zeros((3, 3))
    for (link, _), pose, arm in zip(links, poses, places - centre, strict=True):
        if _is_possible(link):
            total += _turned(link.inertia, rotation.inverse(pose.orientation))
        total += link.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return centre, total


def _is_possible(link: UrdfLink) -> bool:
    """Whether a link has an inertia that a body can have."""
    if link.inertia is None or link.mass <= 0:
        return False
    least, middle, most = np.linalg.eigvalsh(link.inertia)
    return bool(least > 0 and most <= (least + middle) * (1 + ROUNDING))


def _with_capsules(shapes: Sequence[Placed]) -> list[Placed]:
    """The shapes; a cylinder with a ball of its radius at each end is a capsule: URDF has none."""
    balls: set[int] = set()
    capsules: dict[int, Placed] = {}
    for index, (barrel, place) in enumerate(shapes):
        if barrel.kind != 'cylinder':
            continue
        half = rotation.rotate(place.orientation, np.array([0, 0, barrel.length / 2]))
        ends = [_ball_at(shapes, place.position + end, barrel, balls) for end in (half, -half)]
        if None not in ends:
            balls |= set(ends)
            capsules[index] = (Capsule(barrel.radius, barrel.length), place)
    return [capsules.get(index, placed) for index, placed in enumerate(shapes)
            if index not in balls]


def _ball_at(shapes: Sequence[Placed], centre: np.ndarray, barrel: Shape,
             taken: set[int]) -> int | None:
    """Index of a ball as wide as a barrel that has its centre at the barrel's end."""
    return next((index for index, (ball, place) in enumerate(shapes)
                 if ball.kind == 'sphere' and index not in taken
                 and abs(ball.radius - barrel.radius) <= 1e-9
                 and np.abs(place.position - centre).max() < 1e-6 * barrel.length), None)


def _same_inertia(link: UrdfLink) -> Placed | None:
    """The uniform box of a link's mass and inertia: its edge a^2 = 6 (Iy + Iz - Ix) / m.

    None where none is given, or the box would be fifty times lighter or twenty heavier than water.
    """
    if link.inertia is None:
        return None
    moments, axes = np.linalg.eigh(link.inertia)
    squares = 6 * (moments.sum() - 2 * moments) / link.mass
    if not np.isfinite(squares).all() or squares.max() <= THINNEST ** 2:
        return None
    if np.linalg.det(axes) < 0:
        axes = axes * (1, 1, -1)
    box = Box(tuple(np.sqrt(np.maximum(squares, THINNEST ** 2))))
    if not DENSITY / 50 < link.mass / box.volume < DENSITY * 20:
        return None
    return box, link.centre.compose(Pose(orientation=rotation.from_matrix(axes)))
