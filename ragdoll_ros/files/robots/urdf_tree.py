"""URDF parser: links with shapes and inertias, joints, and forward kinematics.

Transmissions, sensors, colours and all else that has no part in the motion are not read.
"""
import math
from dataclasses import dataclass, field
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np

from ...model import errors, rotation
from ...model.pose import Pose
from ...model.ragdoll import tree_errors
from ...model.shapes import SHAPES, SIZES, Shape
from .xml_text import parse_numbers, parse_root

SHORTEST = 1e-9
"""Length from which on a vector is a direction."""

PLANE = 'plane'

WORLD = 'world'
"""A link that a joint may name and no <link> defines, as Drake and MuJoCo have it."""

JOINT_TYPES = ('revolute', 'continuous', 'fixed', 'prismatic', 'planar', 'floating', 'spherical')


ROTATING_KINDS = ('revolute', 'continuous')

AXIAL_KINDS = (*ROTATING_KINDS, 'prismatic', 'planar')


@dataclass(frozen=True)
class UrdfMesh:
    """A mesh of a link: its file as given, ``scale`` (3,), its pose in the link's frame."""

    file: str
    scale: tuple[float, ...]
    pose: Pose


@dataclass
class UrdfLink:
    """A link: ``shapes`` with poses in its frame; ``mass`` kg, zero if none is given."""

    name: str
    mass: float = 0.0
    centre: Pose = field(default_factory=Pose)
    inertia: np.ndarray | None = None
    """(3, 3) kg m^2 about the centre of mass, in the axes of ``centre``."""
    shapes: list[tuple[Shape, Pose]] = field(default_factory=list)
    meshes: list[UrdfMesh] = field(default_factory=list)
    planes: list[Pose] = field(default_factory=list)
    """Frames whose z axis is the normal, of planes that static bodies have."""
    left_out: list[str] = field(default_factory=list)
    """Tags of geometries that no doll has."""
    collides: bool = False
    """Whether its shapes and meshes are those of <collision>, else of <visual>."""
    has_contact: bool = False
    """Whether it has PyBullet's <contact>: friction, restitution."""
    is_static: bool = False
    """Whether its model is <static>, in SDF."""
    is_in_file: bool = True
    """Whether the file has it; not for the frame of a joint of SDF."""


class UrdfMimic(NamedTuple):
    """What a joint follows: its value is multiplier * (the value of ``joint``) + offset."""

    joint: str
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass
class UrdfJoint:
    """A joint: ``origin`` is the child's frame in the parent's at zero, ``axis`` in the child's."""

    name: str
    kind: str
    parent: str
    child: str
    origin: Pose
    axis: np.ndarray
    limits: tuple[float, float] | None
    damping: float
    friction: float = 0.0
    """Coulomb friction, N m (N if prismatic)."""
    mimics: UrdfMimic | None = None


@dataclass
class UrdfTree:
    """A tree of links: links by name, joints by the name of their child."""

    name: str
    links: dict[str, UrdfLink]
    joints: dict[str, UrdfJoint]
    left_out: dict[str, str] = field(default_factory=dict)
    """Child of each joint that would close a loop, by its name. URDF has none."""

    @property
    def order(self) -> list[str]:
        """All links, parents before children."""
        names = [name for name in self.links if name not in self.joints]
        children: dict[str, list[str]] = {}
        for child, joint in self.joints.items():
            children.setdefault(joint.parent, []).append(child)
        for name in names:
            names += children.get(name, ())
        return names

    @property
    def initial_angles(self) -> dict[str, float]:
        """Angles (rad, by child) of joints with limits: zero, or the nearest within the limits."""
        return {child: float(np.clip(0.0, *joint.limits)) for child, joint in self.joints.items()
                if joint.limits}

    def poses(self, values: dict[str, float]) -> dict[str, Pose]:
        """Pose of every link in the root's frame at joint angles, or displacements of prismatic
        joints (rad or m, by child, default zero).
        """
        placed: dict[str, Pose] = {}
        for name in self.order:
            joint = self.joints.get(name)
            if joint is None:
                placed[name] = Pose()
                continue
            value, origin = values.get(name, 0.0), placed[joint.parent].compose(joint.origin)
            placed[name] = origin.compose(
                Pose(value * joint.axis) if joint.kind == 'prismatic' else
                Pose(orientation=rotation.from_axis_angle(joint.axis, value)))
        return placed


def parse_urdf(text: str) -> UrdfTree:
    """Parse URDF. Raises a ModelError for what is no URDF or no tree."""
    root = parse_root(text, 'robot')
    links = [_link(element) for element in root.findall('link')]
    joints = [_joint(element) for element in root.findall('joint')]
    edges = [(joint.parent, joint.child) for joint in joints]
    if WORLD not in (link.name for link in links) and any(WORLD in edge for edge in edges):
        links.insert(0, UrdfLink(WORLD))
    for error in tree_errors([link.name for link in links], edges):
        path = error.path.replace('bones', 'link').replace('joints', 'joint')
        raise type(error)(path, error.value, error.expected.replace('bone', 'link'))
    return UrdfTree(root.get('name') or 'robot', {link.name: link for link in links},
                    {joint.child: joint for joint in joints})


def _link(element: ElementTree.Element) -> UrdfLink:
    link = UrdfLink(_text(element, 'name', 'link'))
    where = f'link {link.name}'
    inertial = element.find('inertial')
    if inertial is not None:
        mass = inertial.find('mass')
        link.mass = 0.0 if mass is None else _number(mass, 'value', where)
        errors.check_range(f'{where}.mass', link.mass, 0, math.inf)
        link.centre = _pose(inertial, where)
        link.inertia = _inertia(inertial.find('inertia'), where)
    link.has_contact = element.find('contact') is not None
    collisions = element.findall('collision')
    link.collides = bool(collisions)
    # Some links have visuals only.
    for part in collisions or element.findall('visual'):
        for geometry in part.findall('geometry/*')[:1]:
            _add_geometry(link, geometry, _pose(part, where), where)
    return link


def _add_geometry(link: UrdfLink, element: ElementTree.Element, pose: Pose, where: str) -> None:
    """Add a shape, mesh or plane to the link; add its tag to ``left_out`` if it is neither shape
    nor mesh, or has no size.
    """
    kind = element.tag
    if kind == 'mesh':
        scale = tuple(_vector(element, 'scale', where, (1, 1, 1)))
        link.meshes.append(UrdfMesh(_text(element, 'filename', f'{where}.mesh'), scale, pose))
    elif kind not in SIZES:
        if kind == PLANE:
            normal = _vector(element, 'normal', where, (0, 0, 1))
            add_plane(link, normal, pose, f'{where}.plane.normal')
        link.left_out.append(f'a <{kind}>')
    else:
        sizes = {key: tuple(_vector(element, key, where)) if key == 'size'
                 else _number(element, key, where) for key in SIZES[kind]}
        add_shape(link, kind, sizes, pose)


def add_plane(link: UrdfLink, normal: np.ndarray, pose: Pose, where: str) -> None:
    """Add a plane through the origin of ``pose`` with a ``normal`` (3,) in its axes to the link."""
    if np.linalg.norm(normal) < SHORTEST:
        raise errors.NotUnit(where, normal.tolist(), 'a direction, not zero')
    turn = rotation.shortest_arc(np.array([0.0, 0, 1]), normal / np.linalg.norm(normal))
    link.planes.append(pose.compose(Pose(orientation=turn)))


def add_shape(link: UrdfLink, kind: str, sizes: dict, pose: Pose) -> None:
    """Add a shape to the link; its tag to ``left_out`` if its sizes are all zero."""
    if not np.any(list(sizes.values())):
        link.left_out.append(f'a <{kind}> of no size')
        return
    try:
        link.shapes.append((SHAPES[kind](**sizes), pose))
    except errors.ModelError as error:
        raise error.at(f'link {link.name}') from None


def _joint(element: ElementTree.Element) -> UrdfJoint:
    name = _text(element, 'name', 'joint')
    where = f'joint {name}'
    kind = element.get('type', '')
    if kind not in JOINT_TYPES:
        raise errors.WrongForm(f'{where}.type', kind, 'one of ' + ', '.join(JOINT_TYPES))
    ends = []
    for end in ('parent', 'child'):
        found = element.find(end)
        if found is None:
            raise errors.WrongForm(where, None, f'a <{end} link="..."/>')
        ends.append(_text(found, 'link', f'{where}.{end}'))
    found = element.find('axis')
    # A joint without an axis may have one, of zeros or of nothing.
    axis = np.array([1.0, 0, 0]) if found is None or kind not in AXIAL_KINDS else _vector(
        found, 'xyz', where)
    if np.linalg.norm(axis) < SHORTEST:
        if kind in ROTATING_KINDS:
            raise errors.NotUnit(f'{where}.axis', axis.tolist(), 'a direction, not zero')
        axis = np.array([1.0, 0, 0])
    found = element.find('limit')
    limits = None
    if kind == 'revolute' and found is not None:
        limits = (_number(found, 'lower', where, 0.0), _number(found, 'upper', where, 0.0))
        if limits[0] > limits[1]:
            raise errors.LimitsReversed(f'{where}.limit', limits, 'lower <= upper')
    found = element.find('dynamics')
    damping, friction = (0.0 if found is None else _number(found, key, where, 0.0)
                         for key in ('damping', 'friction'))
    found = element.find('mimic')
    mimics = None if found is None else UrdfMimic(
        found.get('joint', ''), *(_number(found, key, where, default)
                                  for key, default in (('multiplier', 1.0), ('offset', 0.0))))
    return UrdfJoint(name, kind, *ends, _pose(element, where), axis / np.linalg.norm(axis), limits,
                     max(damping, 0.0), friction, mimics)


def _inertia(element: ElementTree.Element | None, where: str) -> np.ndarray | None:
    if element is None:
        return None
    xx, xy, xz, yy, yz, zz = (_number(element, key, where, 0.0)
                              for key in ('ixx', 'ixy', 'ixz', 'iyy', 'iyz', 'izz'))
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _pose(element: ElementTree.Element, where: str) -> Pose:
    origin = element.find('origin')
    if origin is None:
        return Pose()
    return Pose(_vector(origin, 'xyz', where, (0, 0, 0)),
                rotation.from_rpy(*_vector(origin, 'rpy', where, (0, 0, 0))))


def _text(element: ElementTree.Element, key: str, where: str) -> str:
    text = element.get(key)
    if not text:
        raise errors.WrongForm(where, text, f'a {key}')
    return text


def _number(element: ElementTree.Element, key: str, where: str,
            default: float | None = None) -> float:
    if default is not None and element.get(key) is None:
        return default
    return float(_numbers(element, key, 1, where)[0])


def _vector(element: ElementTree.Element, key: str, where: str,
            default: tuple | None = None) -> np.ndarray:
    if default is not None and element.get(key) is None:
        return np.array(default, float)
    return _numbers(element, key, 3, where)


def _numbers(element: ElementTree.Element, key: str, length: int, where: str) -> np.ndarray:
    return parse_numbers(element.get(key, ''), length, f'{where}.{element.tag}.{key}')
