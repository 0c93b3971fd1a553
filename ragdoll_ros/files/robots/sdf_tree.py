"""SDF parser: links of models and worlds with shapes and inertias, and joints, as a UrdfTree.

Links and joints have their names in the model if it is the file's only one, else the names
model::link. Surfaces, sensors and plugins are not read. http://sdformat.org/spec
"""
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np

from ...model import errors, rotation
from ...model.pose import Pose
from ...model.shapes import SIZES
from .sdf_frames import SdfModel, child_text, parse_pose, text_of
from .urdf_tree import (
    PLANE,
    ROTATING_KINDS,
    SHORTEST,
    UrdfJoint,
    UrdfLink,
    UrdfMesh,
    UrdfMimic,
    UrdfTree,
    add_plane,
    add_shape,
)
from .xml_text import parse_numbers, parse_root

WORLD = ''
"""Name of the root link, to which links without a joint are fixed."""

UNLIMITED = 1e15
"""rad; the limits of a joint that has none are 1e16 or infinite."""

AXES = {**dict.fromkeys((*ROTATING_KINDS, 'prismatic'), ('axis',)),
        **dict.fromkeys(('universal', 'revolute2'), ('axis', 'axis2'))}
"""Axes of the kinds of joints that have some: of those with two, two hinges become."""

KINDS = {'ball': 'spherical', 'universal': 'revolute', 'revolute2': 'revolute'}
"""URDF's kinds for those of SDF that have another name there."""


class SdfAxis(NamedTuple):
    """An axis ``xyz`` (3,) of a joint, in the joint's frame; limits in rad, damping in N m s/rad,
    friction in N m (N s/m and N if prismatic).
    """

    xyz: np.ndarray = np.array([1.0, 0.0, 0.0])
    limits: tuple[float, float] | None = None
    damping: float = 0.0
    friction: float = 0.0
    mimics: UrdfMimic | None = None


@dataclass
class SdfJoint:
    """A joint between two links; ``pose`` is the pose of the joint's frame in the file's frame."""

    name: str
    kind: str
    parent: str
    child: str
    pose: Pose
    axes: list[SdfAxis]


def parse_sdf(text: str) -> UrdfTree:
    """Parse SDF. Raises a ModelError for what is no SDF, or has frames that are not defined."""
    root = parse_root(text, 'sdf')
    try:
        return _parse(root)
    except RecursionError:
        raise errors.Unreadable('', 'frames or models without an end',
                                'no frame relative to itself') from None


def _parse(root: ElementTree.Element) -> UrdfTree:
    world = root.find('world')
    scope, frame, name = SdfModel(root if world is None else world), Pose(), 'world'
    if world is None and len(scope.models) == 1 and root.find('include') is None:
        (name, frame), = ((model, scope.pose(model)) for model in scope.models)
        scope = SdfModel(scope.elements[name])
    links, poses, joints = {WORLD: UrdfLink(WORLD)}, {WORLD: Pose()}, []
    for inner, its_frame in _models(scope, frame):
        for link, pose in _links(inner):
            links[link.name], poses[link.name] = link, its_frame.compose(pose)
        joints += _joints(inner, its_frame, root.get('version', ''))
    if len(links) == 1:
        raise errors.WrongForm('', f'<{root.tag}>', 'a <model> that has a <link>, or a <world>')
    return _tree(name, links, poses, joints)


def _models(scope: SdfModel, frame: Pose) -> Iterator[tuple[SdfModel, Pose]]:
    """A model and all within it, with the poses of their frames."""
    yield scope, frame
    for name, model in scope.models.items():
        yield from _models(model, frame.compose(scope.pose(name)))


def _tree(name: str, links: dict[str, UrdfLink], poses: dict[str, Pose],
          joints: list[SdfJoint]) -> UrdfTree:
    """Return the tree of links. If a link is the child of several joints, the first one moves it. A
    further one is reversed, so that it moves its own parent, if nothing else moves that and no loop
    closes; else the joint is left out.

    A joint of SDF turns about its own frame, one of URDF about its child's frame: so a link without
    a shape is put between.
    """
    tree, held = UrdfTree(name, dict(links), {}), {joint.child for joint in joints}
    for joint in joints:
        if joint.child in tree.joints:
            if joint.parent in (WORLD, *held, *_above(tree, joint.child)):
                tree.left_out[joint.name] = joint.child
                continue
            joint = _reversed(joint)
            held.add(joint.child)
        above, origin = joint.parent, poses[joint.parent].relative(joint.pose)
        for ending, axis in zip(('', '/2'), joint.axes, strict=False):
            turning = f'{joint.name}/joint{ending}'
            tree.links[turning] = UrdfLink(turning, is_in_file=False)
            unlimited = joint.kind == 'revolute' and axis.limits is None
            tree.joints[turning] = UrdfJoint(
                f'{joint.name}{ending}', 'continuous' if unlimited else joint.kind, above, turning,
                origin, *axis)
            above, origin = turning, Pose()
        tree.joints[joint.child] = _fixed(above, joint.child,
                                          joint.pose.relative(poses[joint.child]))
    for link in links:
        if link != WORLD and link not in tree.joints:
            tree.joints[link] = _fixed(WORLD, link, poses[link])
    if lost := tree.links.keys() - set(tree.order):
        raise errors.JointCycle('joint', min(lost), 'joints that form no loop')
    return tree


def _above(tree: UrdfTree, link: str) -> Iterator[str]:
    """The links above one, from its parent to the root."""
    while link in tree.joints:
        link = tree.joints[link].parent
        yield link


def _reversed(joint: SdfJoint) -> SdfJoint:
    """The joint with parent and child exchanged: the same angles are about the opposite axes."""
    axes = [axis._replace(xyz=-axis.xyz) for axis in reversed(joint.axes)]
    return replace(joint, parent=joint.child, child=joint.parent, axes=axes)


def _fixed(parent: str, child: str, pose: Pose) -> UrdfJoint:
    return UrdfJoint(f'{child}/fixed', 'fixed', parent, child, pose, *SdfAxis())


def _links(scope: SdfModel) -> Iterator[tuple[UrdfLink, Pose]]:
    """Yield the links of a model with their poses in its frame; an <include> gives a link without a
    shape.
    """
    for element in scope.element.findall('link'):
        name = element.get('name', '')
        pose = scope.place(element, '')
        link = UrdfLink(f'{scope.prefix}{name}', is_static=scope.is_static)
        inertial = element.find('inertial')
        if inertial is not None:
            _add_inertial(link, inertial)
        collisions = element.findall('collision')
        link.collides = bool(collisions)
        for part in collisions or element.findall('visual'):
            for geometry in part.findall('geometry/*')[:1]:
                _add_geometry(link, geometry, pose.relative(scope.place(part, name)))
        yield link, pose
    for element in scope.element.findall('include'):
        uri = child_text(element, 'uri', f'{scope.prefix}include')
        name = (element.findtext('name') or uri.rstrip('/').rpartition('/')[2]).strip()
        yield UrdfLink(f'{scope.prefix}{name}', collides=True, left_out=['an <include>']), Pose()


def _add_inertial(link: UrdfLink, element: ElementTree.Element) -> None:
    where = f'link {link.name}.inertial'
    link.mass = _number(element, 'mass', where, 0.0)
    errors.check_range(f'{where}.mass', link.mass, 0, math.inf)
    pose = element.find('pose')
    link.centre = Pose() if pose is None else parse_pose(pose, f'{where}.pose')
    inertia = element.find('inertia')
    if inertia is not None:
        xx, xy, xz, yy, yz, zz = (_number(inertia, key, where, default) for key, default in (
            ('ixx', 1.0), ('ixy', 0.0), ('ixz', 0.0), ('iyy', 1.0), ('iyz', 0.0), ('izz', 1.0)))
        link.inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _number(element: ElementTree.Element, path: str, where: str, default: float) -> float:
    """The number that an element has at a ``path`` of tags."""
    text = element.findtext(path)
    if text is None:
        return default
    return float(parse_numbers(text, 1, f'{where}.{path.replace("/", ".")}')[0])


def _add_geometry(link: UrdfLink, element: ElementTree.Element, pose: Pose) -> None:
    kind, where = element.tag, f'link {link.name}'
    if kind == 'mesh' and element.find('submesh') is None:
        scale = parse_numbers(element.findtext('scale', '1 1 1'), 3, f'{where}.mesh.scale')
        link.meshes.append(UrdfMesh(child_text(element, 'uri', f'{where}.mesh'),
                                    tuple(scale.tolist()), pose))
    elif kind in SIZES:
        sizes = {key: parse_numbers(element.findtext(key, ''), 3 if key == 'size' else 1,
                                    f'{where}.{kind}.{key}') for key in SIZES[kind]}
        add_shape(link, kind, {key: tuple(found.tolist()) if key == 'size' else float(found[0])
                               for key, found in sizes.items()}, pose)
    elif kind != 'empty':
        if kind == PLANE:
            normal = parse_numbers(element.findtext('normal', '0 0 1'), 3, f'{where}.plane.normal')
            add_plane(link, normal, pose, f'{where}.plane.normal')
        link.left_out.append('a <submesh>' if kind == 'mesh' else f'a <{kind}>')


def _joints(scope: SdfModel, frame: Pose, version: str) -> Iterator[SdfJoint]:
    """Yield the joints of a model between links; those of a kind without AXES get a default axis,
    which means nothing.
    """
    for element in scope.element.findall('joint'):
        name = f'{scope.prefix}{element.get("name", "")}'
        ends = [child_text(element, end, f'joint {name}') for end in ('parent', 'child')]
        parent, child = map(scope.link_of, ends)
        if child is None:
            continue
        pose, kind = scope.place(element, ends[1]), element.get('type', '')
        axes = [_axis(scope, element, tag, pose, version) for tag in AXES.get(kind, ())]
        if kind == 'prismatic':
            # As in URDF: a doll has none that slides.
            axes = [axes[0]._replace(limits=None)]
        yield SdfJoint(name, KINDS.get(kind, kind), WORLD if parent is None else parent, child,
                       frame.compose(pose), axes or [SdfAxis()])


def _axis(scope: SdfModel, joint: ElementTree.Element, tag: str, pose: Pose,
          version: str) -> SdfAxis:
    """The axis ``tag`` of a joint, which has a ``pose`` in the model's frame."""
    where = f'joint {scope.prefix}{joint.get("name")}.{tag}'
    found = joint.find(tag)
    if found is None:
        return SdfAxis(np.array([0.0, 0.0, 1.0]))
    xyz = found.find('xyz')
    axis = parse_numbers('0 0 1' if xyz is None else xyz.text or '', 3, where)
    if np.linalg.norm(axis) < SHORTEST:
        raise errors.NotUnit(where, axis.tolist(), 'a direction, not zero')
    named = '' if xyz is None else xyz.get('expressed_in', '')
    in_model = (version in ('1.0', '1.2', '1.3', '1.4')
                or found.findtext('use_parent_model_frame') in ('true', '1'))
    # Until 1.4 axes are in the model's frame; until 1.6 where the file says so; then as it names.
    if named or in_model:
        axis = rotation.rotate(pose.relative(scope.pose(named)).orientation, axis)
    return SdfAxis(axis / np.linalg.norm(axis), _limits(found, f'{where}.limit'),
                   max(_number(found, 'dynamics/damping', where, 0.0), 0.0),
                   _number(found, 'dynamics/friction', where, 0.0),
                   _mimics(found.find('mimic'), scope.prefix, where))


def _limits(axis: ElementTree.Element, where: str) -> tuple[float, float] | None:
    """Return the limits of an axis, rad or m; None if one is missing or exceeds UNLIMITED."""
    texts = [axis.findtext(f'limit/{end}', default) for end, default in (
        ('lower', '-inf'), ('upper', 'inf'))]
    try:
        lower, upper = map(float, texts)
    except ValueError:
        raise errors.WrongForm(where, texts, 'two numbers') from None
    if not lower <= upper:
        raise errors.LimitsReversed(where, (lower, upper), 'lower <= upper')
    return None if max(abs(lower), abs(upper)) > UNLIMITED else (lower, upper)


def _mimics(element: ElementTree.Element | None, prefix: str, where: str) -> UrdfMimic | None:
    """What an axis follows: multiplier * (the leader's value - reference) + offset."""
    if element is None:
        return None
    multiplier, offset, reference = (_number(element, key, f'{where}.mimic', default)
                                     for key, default in (
        ('multiplier', 1.0), ('offset', 0.0), ('reference', 0.0)))
    return UrdfMimic(f'{prefix}{text_of(element, "joint", f"{where}.mimic")}', multiplier,
                     offset - multiplier * reference)
