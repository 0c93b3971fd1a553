"""Spring bones of a VRM character: hair, tails and skirts, as its glTF file tells of them.

Read are VRMC_springBone 1.0 and the secondaryAnimation of VRM 0.x. A spring is a chain of nodes;
each but the last is the root of a rod to the next, and its own numbers rule that rod. Colliders,
hit radii, centres and the level part of gravity are left out.
"""
from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...model import errors
from ...model.swing import LENGTH_RANGE
from .gltf_file import GltfFile, nested, objects
from .nodes import Nodes

TAIL = 0.07
"""m: VRM 0.x lets the last node of a chain end so far on, in line."""

SETTINGS = {'stiffness': (1.0, 0.0, 1e6), 'gravityPower': (0.0, -1e6, 1e6),
            'dragForce': (0.5, 0.0, 1.0)}
"""Default (the specification's), least and most."""


@dataclass(frozen=True)
class Rod:
    """VRM's numbers of one rod."""

    stiffness: float
    """Units of the file a second."""
    gravity: float
    """Units of the file a second, downwards."""
    drag: float
    """Share a frame, 0 to 1."""


@dataclass(frozen=True)
class Spring:
    """A chain of the file's ``nodes`` (n) and the ``rods`` from each to the next."""

    name: str
    nodes: tuple[int, ...]
    rods: tuple[Rod, ...]
    points: np.ndarray | None = None
    """(rods + 1, 3) of the nodes, bind pose: the file's axes and units; a character's in m."""
    carrier: int = -1
    """The character's bone above the first node."""
    bones: tuple[int, ...] = ()
    """The character's bones that swing."""


def read_springs(file: GltfFile, nodes: Nodes, notes: list[str]) -> list[Spring]:
    """All springs, without points; a ModelError for what is broken, a note on what is left out."""
    extensions = nested(file.json, 'extensions', dict, '')
    found: list[Spring] = []
    if 'VRMC_springBone' in extensions:
        where = 'extensions.VRMC_springBone'
        data = nested(extensions, 'VRMC_springBone', dict, 'extensions')
        for number, entry in enumerate(objects(data, 'springs', where)):
            found.append(_spring(file, nodes, entry, f'{where}.springs[{number}]'))
    else:
        where = 'extensions.VRM.secondaryAnimation'
        data = nested(nested(extensions, 'VRM', dict, 'extensions'), 'secondaryAnimation', dict,
                      'extensions.VRM')
        for number, entry in enumerate(objects(data, 'boneGroups', where)):
            found += _group(file, nodes, entry, f'{where}.boneGroups[{number}]')
        found.sort(key=lambda spring: nodes.order.index(spring.nodes[0]))
    springs, taken = [], set()
    for spring in found:
        if not spring.rods:
            notes.append(f'spring {spring.name} has one node and so nothing to swing: left out')
        elif taken.intersection(spring.nodes):
            notes.append(f'spring {spring.name} shares a node with another: left out')
        else:
            springs.append(spring)
            taken.update(spring.nodes)
    return springs


def placed(spring: Spring, nodes: Nodes, rests: dict[int, np.ndarray]) -> Spring:
    """The spring with its points in the bind pose, ``rests`` of the nodes that a skin binds.

    Other nodes stand to the nearest of these above them as the file's nodes do. NotFinite or
    WrongForm where that leaves no place.
    """
    points = [_place(node, nodes, rests) for node in spring.nodes]
    if len(points) == len(spring.rods):
        above = nodes.parents[spring.nodes[-1]]
        step = points[-1] - (_place(above, nodes, rests) if above >= 0 else points[-1])
        length = float(np.linalg.norm(step))
        points.append(points[-1] + (step / length if length > 0 else (0, -1, 0)) * np.array(TAIL))
    if not np.isfinite(points).all():
        raise errors.NotFinite(f'spring {spring.name}', 'nodes', 'places that are finite')
    return replace(spring, points=np.array(points))


def without_short_rods(spring: Spring, notes: list[str]) -> Spring:
    """The spring (points in m) without rods too short to swing: their ends become one point."""
    lengths = np.linalg.norm(np.diff(spring.points, axis=0), axis=1)
    long = lengths >= LENGTH_RANGE[0]
    if long.all():
        return spring
    notes.append(f'spring {spring.name} has rods below {1000 * LENGTH_RANGE[0]:g} mm: left out')
    return replace(spring, points=spring.points[np.concatenate([[True], long])],
                   rods=tuple(rod for rod, keep in zip(spring.rods, long, strict=True) if keep))


def _spring(file: GltfFile, nodes: Nodes, entry: dict, where: str) -> Spring:
    joints = objects(entry, 'joints', where)
    if not joints:
        raise errors.WrongForm(f'{where}.joints', joints, 'at least one joint')
    chain: list[int] = []
    for number, joint in enumerate(joints):
        place, node = f'{where}.joints[{number}].node', joint.get('node')
        file.entry('nodes', node, place)
        if chain and not _below(node, chain[-1], nodes):
            raise errors.WrongForm(place, node, f'a node below nodes[{chain[-1]}], which is '
                                   'before it in the chain')
        chain.append(node)
    rods = tuple(_rod(joint, f'{where}.joints[{number}]')
                 for number, joint in enumerate(joints))[:-1]
    return Spring(_name(file, entry.get('name'), chain[0]), tuple(chain), rods)


def _group(file: GltfFile, nodes: Nodes, entry: dict, where: str) -> list[Spring]:
    """Springs of a group of VRM 0.x: one from each root down its first children."""
    # The misspelt key is the format's own.
    entry = {'stiffness': 1.0, **entry}
    entry['stiffness'] = entry.get('stiffiness', entry['stiffness'])
    down = entry.get('gravityDir')
    entry['gravityDir'] = [down.get(axis) for axis in 'xyz'] if isinstance(down, dict) else down
    rod = _rod(entry, where)
    springs = []
    for root in nested(entry, 'bones', list, where):
        file.entry('nodes', root, f'{where}.bones')
        chain = [root]
        while nodes.children[chain[-1]]:
            chain.append(nodes.children[chain[-1]][0])
        springs.append(Spring(_name(file, None, root), tuple(chain), (rod,) * len(chain)))
    return springs


def _rod(data: dict, where: str) -> Rod:
    values = {}
    for key, (default, least, most) in SETTINGS.items():
        value = data.get(key, default)
        if type(value) not in (int, float) or not least <= value <= most:
            raise errors.OutOfRange(f'{where}.{key}', value, f'a number from {least:g} to {most:g}')
        values[key] = float(value)
    down = data.get('gravityDir') or [0, -1, 0]
    if not isinstance(down, list) or len(down) != 3 or not all(
            type(part) in (int, float) and abs(part) < 1e6 for part in down):
        raise errors.WrongForm(f'{where}.gravityDir', down, '3 numbers')
    length = float(np.linalg.norm(down)) or 1.0
    return Rod(values['stiffness'], -values['gravityPower'] * down[1] / length, values['dragForce'])


def _place(node: int, nodes: Nodes, rests: dict[int, np.ndarray]) -> np.ndarray:
    """Point (3,) of a node, as it stands to the nearest node at or above it that a skin binds."""
    bound = node
    while bound >= 0 and bound not in rests:
        bound = nodes.parents[bound]
    if bound in (node, -1):
        return (rests[node] if bound >= 0 else nodes.worlds[node])[:3, 3]
    try:
        back = np.linalg.inv(nodes.worlds[bound])
    except np.linalg.LinAlgError:
        raise errors.WrongForm(f'nodes[{bound}]', 'a scale of zero',
                               'nodes that leave a spring its length') from None
    return (rests[bound] @ back @ nodes.worlds[node])[:3, 3]


def _below(node: int, above: int, nodes: Nodes) -> bool:
    node = nodes.parents[node]
    while node not in (-1, above):
        node = nodes.parents[node]
    return node == above


def _name(file: GltfFile, given: object, node: int) -> str:
    given = given or file.json['nodes'][node].get('name')
    return given if given and isinstance(given, str) else f'spring_{node}'
