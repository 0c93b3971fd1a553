"""The nodes of a glTF file as one forest with the place of each in the file's world."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..model import errors, rotation
from .gltf_file import GltfFile, item


@dataclass(frozen=True)
class Nodes:
    """``parents`` (-1 at the top), ``order`` (parents first), ``worlds`` (n, 4, 4)."""

    parents: list[int]
    order: list[int]
    worlds: np.ndarray


def read_nodes(file: GltfFile) -> Nodes:
    """Read the forest; JointCycle or ConnectedTwice where the nodes form none."""
    nodes = file.document.nodes
    parents = [-1] * len(nodes)
    for index, node in enumerate(nodes):
        for child in node.children or ():
            item(nodes, child, f'nodes[{index}].children', 'nodes')
            if parents[child] >= 0:
                raise errors.ConnectedTwice(f'nodes[{index}].children', child,
                                            'a node that has no parent yet')
            parents[child] = index
    order = [index for index, parent in enumerate(parents) if parent < 0]
    for index in order:
        order.extend(nodes[index].children or ())
    if len(order) < len(nodes):
        missing = min(set(range(len(nodes))) - set(order))
        raise errors.JointCycle(f'nodes[{missing}]', 'a cycle among the nodes',
                                'nodes that form trees')
    worlds = np.zeros((len(nodes), 4, 4))
    for index in order:
        local = _local(nodes[index], f'nodes[{index}]')
        parent = parents[index]
        worlds[index] = local if parent < 0 else worlds[parent] @ local
    return Nodes(parents, order, worlds)


def _local(node: object, where: str) -> np.ndarray:
    """Matrix (4, 4) of a node in its parent: column-major, or translation, rotation, scale."""
    if node.matrix is not None:
        return _numbers(node.matrix, 16, f'{where}.matrix').reshape(4, 4).T
    matrix = np.eye(4)
    turn = np.array(rotation.IDENTITY)
    if node.rotation is not None:
        turn = _numbers(node.rotation, 4, f'{where}.rotation')
        if np.linalg.norm(turn) < 1e-9:
            raise errors.NotUnit(f'{where}.rotation', node.rotation, 'a quaternion, not zero')
    matrix[:3, :3] = rotation.matrix(rotation.normalized(turn))
    if node.scale is not None:
        matrix[:3, :3] *= _numbers(node.scale, 3, f'{where}.scale')
    if node.translation is not None:
        matrix[:3, 3] = _numbers(node.translation, 3, f'{where}.translation')
    return matrix


def _numbers(values: object, length: int, where: str) -> np.ndarray:
    plain = isinstance(values, list) and len(values) == length
    if not plain or not all(type(value) in (int, float) for value in values):
        raise errors.WrongForm(where, values, f'{length} numbers')
    numbers = np.array([float(value) for value in values])
    # Products of a few hundred such numbers must stay finite.
    if not (np.abs(numbers) < 1e30).all():
        raise errors.NotFinite(where, values, f'{length} finite numbers of sensible size')
    return numbers
