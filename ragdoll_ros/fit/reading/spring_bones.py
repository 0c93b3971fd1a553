"""Spring bones of a VRM character: hair, tails and skirts.

VRMC_springBone 1.0 and the secondaryAnimation of VRM 0.x. A spring is a chain of nodes; each joint
governs the segment to the next node. Centers and the horizontal part of gravity are ignored;
colliders are read by spring_colliders.py.
"""
from dataclasses import dataclass, replace

import numpy as np

from ...files.gltf.gltf_file import GltfFile, get_container, get_objects
from ...files.gltf.nodes import Nodes
from ...model import errors
from ...model.swing import LENGTH_RANGE
from .spring_colliders import SpringCollider, colliders_of, read_new_colliders, read_old_colliders

TIP_LENGTH = 0.07
"""m; length of the segment beyond the last node in VRM 0.x."""

JOINT_SETTINGS = {'stiffness': (1.0, 0.0, 1e6), 'gravityPower': (0.0, -1e6, 1e6),
                  'dragForce': (0.5, 0.0, 1.0), 'hitRadius': (0.0, 0.0, 1e6)}
"""Default of the specification, minimum, maximum."""


@dataclass(frozen=True)
class SpringJoint:
    """VRM's settings of one joint of a spring."""

    stiffness: float
    """Units of the file per second."""
    gravity: float
    """Units of the file per second, downwards."""
    drag: float
    """Fraction per frame, 0 to 1."""
    radius: float = 0.0
    """Of the sphere at its end, for colliders: units of the file."""


@dataclass(frozen=True)
class SpringBone:
    """A chain of ``nodes`` of the file; ``joints`` govern the segments between them."""

    name: str
    nodes: tuple[int, ...]
    joints: tuple[SpringJoint, ...]
    points: np.ndarray | None = None
    """(joints + 1, 3), bind pose: the file's axes and units; of a character, m."""
    carrier: int = -1
    """The character's bone that the chain is attached to."""
    bones: tuple[int, ...] = ()
    """The character's bones in the chain."""
    links: tuple[int, ...] = ()
    """The segment that each of these moves with, from 0."""
    colliders: tuple[SpringCollider, ...] = ()


def read_springs(file: GltfFile, nodes: Nodes, notes: list[str]) -> list[SpringBone]:
    """All spring bones, without points. Notes report those that are ignored.

    Raises a ModelError for broken data.
    """
    extensions = get_container(file.json, 'extensions', dict, '')
    found: list[SpringBone] = []
    if 'VRMC_springBone' in extensions:
        where = 'extensions.VRMC_springBone'
        data = get_container(extensions, 'VRMC_springBone', dict, 'extensions')
        groups = read_new_colliders(file, data, where, notes)
        for number, entry in enumerate(get_objects(data, 'springs', where)):
            place = f'{where}.springs[{number}]'
            found.append(replace(_spring(file, nodes, entry, place),
                                 colliders=colliders_of(entry, groups, place)))
    else:
        where = 'extensions.VRM.secondaryAnimation'
        data = get_container(get_container(extensions, 'VRM', dict, 'extensions'),
                             'secondaryAnimation', dict, 'extensions.VRM')
        groups = read_old_colliders(file, data, where)
        for number, entry in enumerate(get_objects(data, 'boneGroups', where)):
            place = f'{where}.boneGroups[{number}]'
            colliders = colliders_of(entry, groups, place)
            found += [replace(spring, colliders=colliders)
                      for spring in _bone_group(file, nodes, entry, place)]
        found.sort(key=lambda spring: nodes.order.index(spring.nodes[0]))
    springs, taken = [], set()
    for spring in found:
        if not spring.joints:
            notes.append(f'spring {spring.name} has one node and so no segment: ignored')
        elif taken.intersection(spring.nodes):
            notes.append(f'spring {spring.name} shares a node with another: ignored')
        else:
            springs.append(spring)
            taken.update(spring.nodes)
    return springs


def with_points(spring: SpringBone, nodes: Nodes,
                bind_matrices: dict[int, np.ndarray]) -> SpringBone:
    """The spring with its points in the bind pose; ``bind_matrices`` are those of skin joints.

    Other nodes keep their transform relative to the nearest such ancestor. Raises NotFinite or
    WrongForm where that is undefined.
    """
    points = [node_matrix(node, nodes, bind_matrices)[:3, 3] for node in spring.nodes]
    if len(points) == len(spring.joints):
        above = nodes.parents[spring.nodes[-1]]
        step = points[-1] - (node_matrix(above, nodes, bind_matrices)[:3, 3] if above >= 0
                             else points[-1])
        length = float(np.linalg.norm(step))
        direction = step / length if length > 0 else (0, -1, 0)
        points.append(points[-1] + direction * np.array(TIP_LENGTH))
    if not np.isfinite(points).all():
        raise errors.NotFinite(f'spring {spring.name}', 'nodes', 'finite positions')
    return replace(spring, points=np.array(points))


def drop_short_segments(spring: SpringBone, notes: list[str]) -> SpringBone:
    """The spring (points in m) with the ends of segments too short for a swing merged."""
    lengths = np.linalg.norm(np.diff(spring.points, axis=0), axis=1)
    long = lengths >= LENGTH_RANGE[0]
    if long.all():
        return spring
    notes.append(f'spring {spring.name} has segments below {1000 * LENGTH_RANGE[0]:g} mm: ignored')
    joints = tuple(joint for joint, keep in zip(spring.joints, long, strict=True) if keep)
    before = np.minimum(np.cumsum(long) - long, max(len(joints) - 1, 0))
    return replace(spring, points=spring.points[np.concatenate([[True], long])], joints=joints,
                   links=tuple(before[list(spring.links)].tolist()))


def _spring(file: GltfFile, nodes: Nodes, entry: dict, where: str) -> SpringBone:
    joints = get_objects(entry, 'joints', where)
    if not joints:
        raise errors.WrongForm(f'{where}.joints', joints, 'at least one joint')
    chain: list[int] = []
    for number, joint in enumerate(joints):
        place, node = f'{where}.joints[{number}].node', joint.get('node')
        file.entry('nodes', node, place)
        if chain and nodes.nearest(nodes.parents[node], chain[-1:]) < 0:
            raise errors.WrongForm(place, node, f'a node below nodes[{chain[-1]}], which is '
                                   'before it in the chain')
        chain.append(node)
    joints = tuple(_spring_joint(joint, f'{where}.joints[{number}]')
                   for number, joint in enumerate(joints))[:-1]
    return SpringBone(_name(file, entry.get('name'), chain[0]), tuple(chain), joints)


def _bone_group(file: GltfFile, nodes: Nodes, entry: dict, where: str) -> list[SpringBone]:
    """Spring bones of a VRM 0.x bone group: one from each root along the first children."""
    # The format misspells this key.
    entry = {'stiffness': 1.0, **entry}
    entry['stiffness'] = entry.get('stiffiness', entry['stiffness'])
    down = entry.get('gravityDir')
    entry['gravityDir'] = [down.get(axis) for axis in 'xyz'] if isinstance(down, dict) else down
    joint = _spring_joint(entry, where)
    springs = []
    for root in get_container(entry, 'bones', list, where):
        file.entry('nodes', root, f'{where}.bones')
        chain = [root]
        while nodes.children[chain[-1]]:
            chain.append(nodes.children[chain[-1]][0])
        springs.append(SpringBone(_name(file, None, root), tuple(chain), (joint,) * len(chain)))
    return springs


def _spring_joint(data: dict, where: str) -> SpringJoint:
    values = {}
    for key, (default, least, most) in JOINT_SETTINGS.items():
        value = data.get(key, default)
        if type(value) not in (int, float) or not least <= value <= most:
            raise errors.OutOfRange(f'{where}.{key}', value, f'a number from {least:g} to {most:g}')
        values[key] = float(value)
    down = data.get('gravityDir') or [0, -1, 0]
    if not isinstance(down, list) or len(down) != 3 or not all(
            type(part) in (int, float) and abs(part) < 1e6 for part in down):
        raise errors.WrongForm(f'{where}.gravityDir', down, '3 numbers')
    length = float(np.linalg.norm(down)) or 1.0
    return SpringJoint(values['stiffness'], -values['gravityPower'] * down[1] / length,
                       values['dragForce'], values['hitRadius'])


def node_matrix(node: int, nodes: Nodes, bind_matrices: dict[int, np.ndarray]) -> np.ndarray:
    """Transform (4, 4) of a node, fixed to the nearest skin joint at or above it."""
    joint_node = nodes.nearest(node, bind_matrices)
    if joint_node in (node, -1):
        return bind_matrices[node] if joint_node >= 0 else nodes.worlds[node]
    try:
        back = np.linalg.inv(nodes.worlds[joint_node])
    except np.linalg.LinAlgError:
        raise errors.WrongForm(f'nodes[{joint_node}]', 'a scale of zero',
                               'nodes that give a spring a length') from None
    return bind_matrices[joint_node] @ back @ nodes.worlds[node]


def _name(file: GltfFile, given: object, node: int) -> str:
    given = given or file.json['nodes'][node].get('name')
    return given if given and isinstance(given, str) else f'spring_{node}'
