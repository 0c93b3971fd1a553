"""Nodes of a glTF file as a forest with global transforms."""
from collections.abc import Container
from dataclasses import dataclass

import numpy as np

from ...model import errors, rotation
from .gltf_file import GltfFile, get_container

TO_ROS = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
"""glTF has +Y up, +Z forward and +X left: its (z, x, y) is (x, y, z) here."""


@dataclass(frozen=True)
class Nodes:
    """The n nodes of a file, by their index."""

    parents: list[int]
    """-1 for a root."""
    children: list[list[int]]
    order: list[int]
    """Every node once, parents first."""
    worlds: np.ndarray
    """(n, 4, 4) global transforms, from the node's frame to the world; units of the file."""
    locals: np.ndarray
    """(n, 4, 4) transforms from the node's frame to its parent's."""

    def nearest(self, node: int, among: Container[int]) -> int:
        """The node itself if it is ``among`` these nodes, else the nearest one above it that is;
        -1 if there is none.
        """
        while node >= 0 and node not in among:
            node = self.parents[node]
        return node


def read_nodes(file: GltfFile) -> Nodes:
    """Nodes of a file.

    Raises JointCycle or ConnectedTwice where they form no forest, OutOfRange for a child that is
    no node, WrongForm, NotFinite or NotUnit for a broken transform.
    """
    nodes = file.json['nodes']
    parents = [-1] * len(nodes)
    below = [get_container(node, 'children', list, f'nodes[{index}]')
             for index, node in enumerate(nodes)]
    for index, children in enumerate(below):
        for child in children:
            file.entry('nodes', child, f'nodes[{index}].children')
            if parents[child] >= 0:
                raise errors.ConnectedTwice(f'nodes[{index}].children', child,
                                            'a node that has no parent yet')
            parents[child] = index
    order = [index for index, parent in enumerate(parents) if parent < 0]
    for index in order:
        order.extend(below[index])
    if len(order) < len(nodes):
        missing = min(set(range(len(nodes))) - set(order))
        raise errors.JointCycle(f'nodes[{missing}]', 'a cycle among the nodes',
                                'nodes that form trees')
    worlds, local = np.zeros((2, len(nodes), 4, 4))
    for index in order:
        local[index] = _local_matrix(nodes[index], f'nodes[{index}]')
        parent = parents[index]
        worlds[index] = local[index] if parent < 0 else worlds[parent] @ local[index]
    return Nodes(parents, below, order, worlds, local)


def _local_matrix(node: dict, where: str) -> np.ndarray:
    """Local transform (4, 4) of a node, from its matrix or its translation, rotation, scale."""
    given = node.get('matrix')
    if given is not None:
        return _numbers(given, 16, f'{where}.matrix').reshape(4, 4).T
    parts = local_parts(node, where)
    matrix = np.eye(4)
    matrix[:3, :3] = rotation.matrix(parts['rotation']) * parts['scale']
    matrix[:3, 3] = parts['translation']
    return matrix


def local_parts(node: dict, where: str) -> dict[str, np.ndarray]:
    """``translation`` (3,), ``rotation``, a unit quaternion (4,), and ``scale`` (3,) of a node.

    A matrix is decomposed, its shear left out. Raises WrongForm, NotFinite or NotUnit.
    """
    if node.get('matrix') is not None:
        matrix = _numbers(node['matrix'], 16, f'{where}.matrix').reshape(4, 4).T
        turn = rotation.nearest_rotation(matrix[:3, :3])
        scale = np.diag(rotation.matrix(turn).T @ matrix[:3, :3])
        return {'translation': matrix[:3, 3], 'rotation': turn, 'scale': scale}
    translation, quaternion, scale = (
        np.array(default, float) if node.get(key) is None
        else _numbers(node[key], len(default), f'{where}.{key}')
        for key, default in (('translation', (0, 0, 0)), ('rotation', rotation.IDENTITY),
                             ('scale', (1, 1, 1))))
    if np.linalg.norm(quaternion) < 1e-9:
        raise errors.NotUnit(f'{where}.rotation', node['rotation'], 'a quaternion, not zero')
    return {'translation': translation, 'rotation': rotation.normalized(quaternion),
            'scale': scale}


def _numbers(values: object, length: int, where: str) -> np.ndarray:
    plain = isinstance(values, list) and len(values) == length
    if not plain or not all(type(value) in (int, float) for value in values):
        raise errors.WrongForm(where, values, f'{length} numbers')
    # Products of a few hundred such numbers must stay finite.
    if not all(abs(value) < 1e30 for value in values):
        raise errors.NotFinite(where, values, f'{length} finite numbers of sensible size')
    return np.array(values, float)
