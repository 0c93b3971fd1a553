"""SDF parser: links of models and worlds with their collision shapes, as a UrdfTree.

Names are those in the file's only model; in a world, or of several models, model::link. Visuals,
inertias and surfaces are not read. http://sdformat.org/spec
"""
from collections.abc import Iterator
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np

from ...model import errors, rotation
from ...model.pose import Pose
from ...model.shapes import SIZES
from .sdf_frames import SdfModel, child_text
from .urdf_tree import (
    PLANE,
    ROTATING_KINDS,
    UrdfJoint,
    UrdfLink,
    UrdfMesh,
    UrdfTree,
    add_plane,
    add_shape,
)
from .xml_text import parse_numbers, parse_root

WORLD = ''
"""Name of the root link, to which links without a joint are fixed."""

UNLIMITED = 1e15
"""rad; the limits of a joint that has none are 1e16 or infinite."""

X = np.array([1.0, 0.0, 0.0])


@dataclass
class SdfJoint:
    """A joint between two links; ``pose`` is that of its frame in the file's."""

    name: str
    kind: str
    parent: str
    child: str
    pose: Pose
    axis: np.ndarray
    limits: tuple[float, float] | None


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
    """Tree of links: of several joints of a link the first moves it.

    A joint of SDF turns about its own frame, one of URDF about its child's: a link without a shape
    is between.
    """
    tree = UrdfTree(name, dict(links), {})
    for joint in joints:
        if joint.child in tree.joints:
            continue
        turning = f'{joint.name}/joint'
        tree.links[turning] = UrdfLink(turning)
        tree.joints[turning] = UrdfJoint(
            joint.name, joint.kind, joint.parent, turning, poses[joint.parent].relative(joint.pose),
            joint.axis, joint.limits, 0.0)
        tree.joints[joint.child] = _fixed(turning, joint.child,
                                          joint.pose.relative(poses[joint.child]))
    for link in links:
        if link != WORLD and link not in tree.joints:
            tree.joints[link] = _fixed(WORLD, link, poses[link])
    if lost := tree.links.keys() - set(tree.order):
        raise errors.JointCycle('joint', min(lost), 'joints that form no loop')
    return tree


def _fixed(parent: str, child: str, pose: Pose) -> UrdfJoint:
    return UrdfJoint(f'{child}/fixed', 'fixed', parent, child, pose, X, None, 0.0)


def _links(scope: SdfModel) -> Iterator[tuple[UrdfLink, Pose]]:
    """Links of a model with their poses in its frame; what is included is one that has no shape."""
    for element in scope.element.findall('link'):
        name = element.get('name', '')
        pose, link = scope.place(element, ''), UrdfLink(f'{scope.prefix}{name}')
        for collision in element.findall('collision'):
            link.collides = True
            for geometry in collision.findall('geometry/*')[:1]:
                _add_geometry(link, geometry, pose.relative(scope.place(collision, name)))
        yield link, pose
    for element in scope.element.findall('include'):
        uri = child_text(element, 'uri', f'{scope.prefix}include')
        name = (element.findtext('name') or uri.rstrip('/').rpartition('/')[2]).strip()
        yield UrdfLink(f'{scope.prefix}{name}', collides=True, left_out=['an <include>']), Pose()


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
    """Joints of a model between links; those that neither turn nor slide are fixed."""
    for element in scope.element.findall('joint'):
        name = f'{scope.prefix}{element.get("name", "")}'
        ends = [child_text(element, end, f'joint {name}') for end in ('parent', 'child')]
        parent, child = map(scope.link_of, ends)
        if child is None:
            continue
        pose = scope.place(element, ends[1])
        kind = element.get('type', '')
        rotating, moving = kind in ROTATING_KINDS, kind in (*ROTATING_KINDS, 'prismatic')
        yield SdfJoint(name, kind if moving else 'fixed',
                       WORLD if parent is None else parent, child, frame.compose(pose),
                       _axis(scope, element, pose, version) if moving else X,
                       _limits(element, f'joint {name}.limit') if rotating else None)


def _axis(scope: SdfModel, joint: ElementTree.Element, pose: Pose, version: str) -> np.ndarray:
    """Axis (3,) of a joint, which has a pose in the model's frame, in its own frame."""
    where = f'joint {scope.prefix}{joint.get("name")}.axis'
    xyz = joint.find('axis/xyz')
    axis = parse_numbers('0 0 1' if xyz is None else xyz.text or '', 3, where)
    if np.linalg.norm(axis) < 1e-9:
        raise errors.NotUnit(where, axis.tolist(), 'a direction, not zero')
    named = '' if xyz is None else xyz.get('expressed_in', '')
    in_model = (version in ('1.0', '1.2', '1.3', '1.4')
                or joint.findtext('axis/use_parent_model_frame') in ('true', '1'))
    # Until 1.4 axes are in the model's frame; until 1.6 where the file says so; then as it names.
    if named or in_model:
        axis = rotation.rotate(pose.relative(scope.pose(named)).orientation, axis)
    return axis / np.linalg.norm(axis)


def _limits(joint: ElementTree.Element, where: str) -> tuple[float, float] | None:
    """Limits of a joint, rad; None without."""
    texts = [joint.findtext(f'axis/limit/{end}', default) for end, default in (
        ('lower', '-inf'), ('upper', 'inf'))]
    try:
        lower, upper = map(float, texts)
    except ValueError:
        raise errors.WrongForm(where, texts, 'two numbers') from None
    if not lower <= upper:
        raise errors.LimitsReversed(where, (lower, upper), 'lower <= upper')
    return None if max(abs(lower), abs(upper)) > UNLIMITED else (lower, upper)
