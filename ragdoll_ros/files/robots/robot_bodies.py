"""Static bodies from a URDF or SDF: one of each link that has collision shapes.

In a scene's `bodies:` these are the entries `{urdf: FILE}` and `{sdf: FILE}`.
"""
import dataclasses
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...model import errors
from ...model.compound import Compound
from ...model.errors import ModelError
from ...model.pose import Pose
from ...model.rotation import IDENTITY
from ...model.scene import LIMIT_TOLERANCE
from ...model.shapes import Part, Shape
from ...model.static_body import StaticBody
from ...model.vectors import Quaternion, Vector, floats
from ..config import config_folder
from ..doll import plain_name
from .mesh_file import bounding_box, find_file, read_mesh
from .sdf_tree import parse_sdf
from .urdf_tree import UrdfLink, UrdfTree, parse_urdf
from .xml_text import read_xml

PARSERS = {'urdf': ('robot', parse_urdf), 'sdf': ('sdf', parse_sdf)}
"""Root element and parser of a file, by the key of its entry."""

OPTIONS = ('angles_deg', 'meshes', 'without')
"""Keys of entries with a file alone."""

SURFACE = ('friction', 'rolling_friction', 'restitution', 'color')
"""Keys of entries that hold for the bodies of all links."""

ROTATING_KINDS = ('revolute', 'continuous')

INSTEAD = {'a <plane>': "the scene's `ground`",
           'an <include>': 'the model itself, as `gz sdf -p FILE` prints it'}
"""What stands in a scene for an element that no body has; for others PRIMITIVES."""

PRIMITIVES = 'a box, sphere, cylinder or capsule'


@dataclass(frozen=True)
class PlacedRobot:
    """A body for each link of a file, by the link's name, in the file's frame; and the pose of that
    frame in the world: ``position`` (3,) m, ``orientation`` x, y, z, w.
    """

    name: str
    links: dict[str, StaticBody]
    position: Vector = (0.0, 0.0, 0.0)
    orientation: Quaternion = IDENTITY

    def bodies(self) -> Iterator[StaticBody]:
        """The bodies in the world, named robot_link."""
        frame = Pose(floats(self.position), floats(self.orientation))
        for link, body in self.links.items():
            yield dataclasses.replace(body, name=plain_name(f'{self.name}_{link}', self.name),
                                      **_placed(frame.compose(body.pose)))


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
        poses = tree.poses(_angles(tree, entry.get('angles_deg', {})))
        left_out = _left_out(tree, entry.get('without', ()))
    except ModelError as error:
        return None, [error]
    surface = {name: entry[name] for name in SURFACE if name in entry}
    links, found = {}, []
    for link in (link for name, link in tree.links.items() if name not in left_out):
        try:
            if link.collides:
                links[link.name] = _body(link, poses[link.name], entry, path.parent, surface)
        except ModelError as error:
            found.append(error.at(f'{key}.({path.name}).link {link.name}'))
    if not links and not found:
        found = [errors.WrongForm(key, entry[key], 'a file with a link that has a <collision>')]
    start = {name: entry[name] for name in ('position', 'orientation') if name in entry}
    return (None if found else PlacedRobot(entry['name'], links, **start)), found


def _body(link: UrdfLink, pose: Pose, entry: dict, folder: Path, surface: dict) -> StaticBody:
    """The body of a link, whose frame has the ``pose``. Raises a ModelError for a shape that no
    body has.
    """
    for what in link.left_out:
        raise errors.WrongForm('', what, f'{INSTEAD.get(what, PRIMITIVES)}; leave the link out by '
                               f'`without: [{link.name}]`')
    shapes: list[tuple[Shape, Pose]] = list(link.shapes)
    for mesh in link.meshes:
        if entry.get('meshes') != 'box':
            raise errors.WrongForm('mesh', mesh.file, f'{PRIMITIVES}; `meshes: box` takes the box '
                                   'around each mesh')
        path = find_file(mesh.file, folder)
        if path is None:
            raise errors.Unreadable('mesh', mesh.file, 'a file beside this one or in a ROS package')
        box, place = bounding_box(read_mesh(path, mesh.scale))
        shapes.append((box, mesh.pose.compose(place)))
    if len(shapes) == 1:
        (shape, place), = shapes
        return StaticBody(link.name, shape, **_placed(pose.compose(place)), **surface)
    whole = Compound(tuple(Part.at(shape, place) for shape, place in shapes))
    return StaticBody(link.name, whole, **_placed(pose), **surface)


def _placed(pose: Pose) -> dict[str, Any]:
    return {'position': floats(pose.position), 'orientation': floats(pose.orientation)}


def _angles(tree: UrdfTree, given: dict[str, float]) -> dict[str, float]:
    """Angles of all joints, rad by child, of which some are ``given``, degrees by name."""
    joints = {joint.name: joint for joint in tree.joints.values() if joint.kind in ROTATING_KINDS}
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
