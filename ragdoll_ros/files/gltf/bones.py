"""Bones of a glTF file: which nodes they are, what they are called, their bind poses."""
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...model import errors
from ...model.ragdoll import WORLD
from ..doll import plain_name
from .bind_poses import add_bind_matrices, read_skin
from .gltf_file import GltfFile
from .nodes import Nodes


@dataclass(frozen=True)
class Bones:
    """The n bones of a file, parents first."""

    names: tuple[str, ...]
    nodes: tuple[int, ...]
    """Index of each bone's node."""
    bind_matrices: np.ndarray
    """(n, 4, 4) transforms in the bind pose, from the bone to the world; units of the file."""


def read_bones(file: GltfFile, nodes: Nodes) -> Bones:
    """The bones of a file, as ragdoll_fit names them. Raises a ModelError for a broken skin."""
    found: dict[int, np.ndarray] = {}
    for index, node in enumerate(file.json['nodes']):
        if node.get('mesh') is not None and node.get('skin') is not None:
            joints, inverses = read_skin(file, node['skin'], f'nodes[{index}].skin')
            add_bind_matrices(found, nodes, joints, inverses, [])
    if not found:
        found = {bone: nodes.worlds[bone] for bone in rigid_parts(file, nodes).values()}
    own = tuple(node for node in nodes.order if node in found)
    return Bones(names_of_nodes(file, own), own, np.array([found[node] for node in own]))


def rigid_parts(file: GltfFile, nodes: Nodes) -> dict[int, int]:
    """Bone of each unskinned mesh, by node, of a file without skins.

    Raises WrongForm where the file has a skin or fewer than two parts.
    """
    bones = {node: _bone_of_mesh(file, nodes, node) for node in unskinned_meshes(file)}
    if file.json['skins'] or len(set(bones.values())) < 2:
        raise errors.WrongForm('skins', 'no skin that moves a mesh',
                               'a skinned mesh (a node with both mesh and skin), or a file '
                               'without skins whose parts are meshes of several nodes')
    return bones


def unskinned_meshes(file: GltfFile) -> list[int]:
    """Nodes with a mesh and without a skin."""
    return [index for index, node in enumerate(file.json['nodes'])
            if node.get('mesh') is not None and node.get('skin') is None]


def _bone_of_mesh(file: GltfFile, nodes: Nodes, node: int) -> int:
    """Return the bone of an unskinned mesh: the parent of its ``node`` if the node is the only leaf
    among the parent's children and the parent has no mesh; else the node.
    """
    parent = nodes.parents[node]
    if parent < 0 or nodes.children[node]:
        return node
    ends = [other for other in nodes.children[parent] if not nodes.children[other]]
    held = file.json['nodes'][parent].get('mesh') is not None
    return node if held or len(ends) > 1 else parent


def names_of_nodes(file: GltfFile, nodes: Sequence[int]) -> tuple[str, ...]:
    """Unique names of bones, by the names of their nodes."""
    return unique_names([file.json['nodes'][node].get('name') for node in nodes], 'bone')


def unique_names(given: Sequence[object], kind: str) -> tuple[str, ...]:
    """Unique names as a doll may have them; what has no name becomes kind_N."""
    taken = {WORLD: 1}
    names = []
    for number, name in enumerate(given):
        text = plain_name(name if isinstance(name, str) else '', f'{kind}_{number}')
        while text in taken:
            taken[text] += 1
            text = f'{text}_{taken[text]}'
        taken[text] = 1
        names.append(text)
    return tuple(names)
