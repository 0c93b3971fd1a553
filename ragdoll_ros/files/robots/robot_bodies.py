"""Bodies from a URDF or SDF: the entries `{urdf: FILE}` and `{sdf: FILE}` of a scene's `bodies:`.

Static: for each link a body of its primitive shapes, to which meshes as `box` or `hulls` belong,
and one for each plane and each other mesh. With `follow` a robot that moves: a body for each link,
in the link's frame.
"""
import dataclasses
import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...model import errors
from ...model.compound import Compound
from ...model.errors import ModelError
from ...model.follow import Follow
from ...model.mesh import Hull, Mesh
from ...model.plane import Plane
from ...model.pose import Pose
from ...model.ragdoll import Bone, Ragdoll
from ...model.robot import ROBOT_JOINTS, Robot, RobotJoint
from ...model.rotation import IDENTITY
from ...model.scene import LIMIT_TOLERANCE, Placement
from ...model.shapes import Box, Part, Shape
from ...model.static_body import DEFAULT_COLOR, StaticBody
from ...model.vectors import Quaternion, Vector, floats
from ..config import config_folder
from ..doll import plain_name
from .hull_decomposition import read_hulls
from .mesh_file import bounding_box, find_file, read_hull, read_mesh, read_surface
from .sdf_tree import parse_sdf
from .urdf_tree import (
    PLANE,
    ROTATING_KINDS,
    UrdfJoint,
    UrdfLink,
    UrdfMesh,
    UrdfMimic,
    UrdfTree,
    parse_urdf,
)
from .xml_text import read_xml

PARSERS = {'urdf': ('robot', parse_urdf), 'sdf': ('sdf', parse_sdf)}
"""Root element and parser of a file, by the key of its entry."""

OPTIONS = ('angles_deg', 'meshes', 'without')
"""Keys of entries with a file alone."""

NOMINAL_MASS = 1.0
"""kg of a body that follows exactly and has no mass of its own. It has no effect."""

SURFACE = ('friction', 'rolling_friction', 'restitution', 'color')
"""Keys of entries that hold for the bodies of all links."""

MESHES = ('box', 'hull', 'hulls', 'exact')
"""What `meshes` may be."""

INSTEAD = {'an <include>': 'the model itself, as `gz sdf -p FILE` prints it'}
"""What stands in a scene for an element that no body has; for others PRIMITIVES."""

PRIMITIVES = 'a box, sphere, cylinder or capsule'


@dataclass(frozen=True)
class PlacedRobot:
    """The bodies of a file's links, in the file's frame; and the pose of that frame in the world:
    ``position`` (3,) m, ``orientation`` x, y, z, w. Of a robot that moves, each of ``links`` is in
    its own frame, ``poses`` are the poses of these frames in the file's frame, and ``joints``
    connect the links.
    """

    name: str
    links: tuple[StaticBody, ...]
    position: Vector = (0.0, 0.0, 0.0)
    orientation: Quaternion = IDENTITY
    joints: tuple[RobotJoint, ...] = ()
    poses: tuple[Pose, ...] = ()

    def bodies(self) -> Iterator[StaticBody]:
        """The bodies in the world, named robot_link."""
        for body in self.links:
            yield dataclasses.replace(body, name=self._name_of(body),
                                      **_placed(self._frame.compose(body.pose)))

    def placements(self) -> Iterator[Placement]:
        """The links in the world, named robot_link; the frame of each is that of its bone."""
        for body, pose in zip(self.links, self.poses, strict=True):
            name = self._name_of(body)
            # With moments, shapes need not be centred: nothing that acts on it moves it.
            bone = Bone(name, Compound(body.parts), NOMINAL_MASS, (0.0, 0.0, 0.0), IDENTITY,
                        body.friction, body.rolling_friction, body.restitution,
                        body.color or DEFAULT_COLOR, moments=(1.0, 1.0, 1.0))
            yield Placement(Ragdoll(name, (bone,)), follow=Follow(),
                            **_placed(self._frame.compose(pose)))

    def robot(self) -> Robot:
        """Return the Robot that moves the links."""
        return Robot(self.name, self.joints, {body.name: self._name_of(body)
                                              for body in self.links},
                     self.position, self.orientation)

    @property
    def _frame(self) -> Pose:
        return Pose(floats(self.position), floats(self.orientation))

    def _name_of(self, body: StaticBody) -> str:
        return plain_name(f'{self.name}_{body.name}', self.name)


def read_robot(entry: dict, folder: Path) -> tuple[PlacedRobot | None, list[ModelError]]:
    """The robot of an entry of a scene in ``folder``; else None and every error."""
    key, = PARSERS.keys() & entry.keys()
    path = find_file(entry[key], folder) or find_file(entry[key], config_folder())
    if path is None:
        return None, [errors.Unreadable(key, entry[key], f'a {key.upper()} file: a path from the '
                                        'scene, or package://PACKAGE/PATH')]
    tag, parse = PARSERS[key]
    try:
        tree = parse(read_xml(path, tag))
    except ModelError as error:
        return None, [error.at(f'{key}.({path.name})')]
    try:
        leaders = _leaders(tree)
        values = _values(tree, leaders, entry.get('angles_deg', {}))
        left_out = _left_out(tree, entry.get('without', ()))
    except ModelError as error:
        return None, [error]
    poses, moves = tree.poses(values), 'follow' in entry
    surface = {name: entry[name] for name in SURFACE if name in entry}
    links: list[StaticBody] = []
    found: list[ModelError] = []
    for link in (link for name, link in tree.links.items() if name not in left_out):
        try:
            if link.collides:
                links += _bodies(link, Pose() if moves else poses[link.name], entry, path.parent,
                                 surface)
        except ModelError as error:
            found.append(error.at(f'{key}.({path.name}).link {link.name}'))
    if not links and not found:
        found = [errors.WrongForm(key, entry[key], 'a file with a link that has a <collision>')]
    if found:
        return None, found
    start: dict[str, Any] = {name: entry[name] for name in ('position', 'orientation')
                             if name in entry}
    if moves:
        start |= {'poses': tuple(poses[body.name] for body in links), 'joints': tuple(
            _robot_joint(joint, values, leaders.get(child))
            for child, joint in tree.joints.items())}
    return PlacedRobot(entry['name'], tuple(links), **start), []


def _bodies(link: UrdfLink, pose: Pose, entry: dict, folder: Path,
            surface: dict) -> list[StaticBody]:
    """The bodies of a link, whose frame has the ``pose``; the second one is named link_2. Raises a
    ModelError for a shape that no body has.
    """
    for what in link.left_out:
        if what != f'a <{PLANE}>':
            raise errors.WrongForm('', what, f'{INSTEAD.get(what, PRIMITIVES)}; leave the link out '
                                   f'by `without: [{link.name}]`')
    solids: list[tuple[Shape | Hull, Pose]] = list(link.shapes)
    others: list[tuple[Plane | Mesh, Pose]] = [(Plane(), place) for place in link.planes]
    how = entry.get('meshes')
    for shape, place in itertools.chain.from_iterable(
            _mesh_shapes(mesh, how, folder) for mesh in link.meshes):
        if isinstance(shape, Hull) and (how == 'hulls' or 'follow' in entry):
            solids.append((dataclasses.replace(shape, source=None), place))
        elif isinstance(shape, Mesh):
            others.append((shape, place))
        else:
            solids.append((shape, place))
    if others and 'follow' in entry:
        raise errors.WrongForm('', f'a {others[0][0].kind}', f'{PRIMITIVES}, or `meshes: hull`, '
                               '`hulls` or `box`: no other moves; leave the link out by '
                               f'`without: [{link.name}]`')
    is_one = len(solids) == 1 and not isinstance(solids[0][0], Hull)
    found: list[tuple[Any, Pose]] = list(solids) if is_one else [
        (Compound(tuple(Part.at(shape, place) for shape, place in solids)), Pose())
    ] if solids else []
    return [StaticBody(f'{link.name}_{number}' if number > 1 else link.name, whole,
                       **_placed(pose.compose(place)), **surface)
            for number, (whole, place) in enumerate(found + others, 1)]


def _mesh_shapes(mesh: UrdfMesh, how: str | None,
                 folder: Path) -> Iterator[tuple[Box | Mesh, Pose]]:
    """Yield the shapes that stand for a mesh, and their poses in the link's frame; ``how`` is one
    of MESHES. Raises a ModelError, also if ``how`` is None.
    """
    if how is None:
        raise errors.WrongForm('mesh', mesh.file, f'{PRIMITIVES}; or `meshes: exact` for its '
                               'triangles, `hull` or `hulls` for its convex hull or several, `box` '
                               'for the box around it')
    path = find_file(mesh.file, folder)
    if path is None:
        raise errors.Unreadable('mesh', mesh.file, 'a file beside this one or in a ROS package')
    try:
        if how == 'box':
            box, place = bounding_box(read_mesh(path, mesh.scale))
            yield box, mesh.pose.compose(place)
        elif how == 'hulls':
            yield from ((hull, mesh.pose) for hull in read_hulls(path, mesh.scale))
        else:
            yield (read_hull if how == 'hull' else read_surface)(path, mesh.scale), mesh.pose
    except ModelError as error:
        raise error.at(f'mesh.({path.name})') from None


def _placed(pose: Pose) -> dict[str, Any]:
    return {'position': floats(pose.position), 'orientation': floats(pose.orientation)}


def _leaders(tree: UrdfTree) -> dict[str, UrdfMimic]:
    """Return what each mimicking joint follows, by child: a joint that mimics none itself, a
    multiplier and an offset. Raises UnknownJoint, JointCycle.
    """
    by_name = {joint.name: joint for joint in tree.joints.values()}
    leaders = {}
    for child, joint in tree.joints.items():
        mimic, passed = joint.mimics, {joint.name}
        while mimic is not None:
            leader, multiplier, offset = mimic
            where = f'joint {joint.name}.mimic'
            if leader not in by_name:
                raise errors.UnknownJoint(where, leader, errors.one_of(list(by_name), leader))
            if leader in passed:
                raise errors.JointCycle(where, leader, 'a joint that does not mimic this one')
            passed.add(leader)
            leaders[child], mimic = mimic, by_name[leader].mimics
            if mimic is not None:
                mimic = UrdfMimic(mimic.joint, multiplier * mimic.multiplier,
                                  multiplier * mimic.offset + offset)
    return leaders


def _robot_joint(joint: UrdfJoint, values: dict[str, float],
                 leader: UrdfMimic | None) -> RobotJoint:
    """Return a joint of a robot that moves; of a kind that is not in ROBOT_JOINTS it
    becomes fixed.
    """
    kind = joint.kind if joint.kind in ROBOT_JOINTS else 'fixed'
    return RobotJoint(joint.name, kind, joint.parent, joint.child, floats(joint.origin.position),
                      floats(joint.origin.orientation), floats(joint.axis),
                      values.get(joint.child, 0.0),
                      None if leader is None or kind == 'fixed' else tuple(leader))


def _values(tree: UrdfTree, leaders: dict[str, UrdfMimic],
            given: dict[str, float]) -> dict[str, float]:
    """Return values of joints, rad or m by child; others are zero. Some are ``given``, in degrees
    by name, else zero or the nearest within the limits; joints that have ``leaders`` follow them.
    """
    joints = {joint.name: joint for joint in tree.joints.values()
              if joint.kind in ROTATING_KINDS and joint.child not in leaders}
    angles = tree.initial_angles
    for name, value in given.items():
        where = f'angles_deg.{name}'
        if name not in joints:
            raise errors.UnknownJoint(where, name, errors.one_of(list(joints), name) if joints
                                      else 'none: no joint of the file turns')
        lower, upper = joints[name].limits or (-math.inf, math.inf)
        angles[joints[name].child] = angle = math.radians(value)
        if not lower - LIMIT_TOLERANCE <= angle <= upper + LIMIT_TOLERANCE:
            raise errors.OutOfRange(where, value, f'{math.degrees(lower):.6g} to '
                                    f'{math.degrees(upper):.6g} degrees, its limits')
    children = {joint.name: child for child, joint in tree.joints.items()}
    for child, (leader, multiplier, offset) in leaders.items():
        angles[child] = multiplier * angles.get(children[leader], 0.0) + offset
    return angles


def _left_out(tree: UrdfTree, names: list[str]) -> set[str]:
    """Names of the links that ``names`` of links and of models leave out."""
    found: set[str] = set()
    for index, name in enumerate(names):
        own = {link for link in tree.links if link == name or link.startswith(f'{name}::')}
        if not own:
            links = [name for name, link in tree.links.items() if link.collides]
            raise errors.WrongForm(f'without[{index}]', name, errors.one_of(links, name))
        found |= own
    return found
