"""Skinned meshes of a glTF file: every vertex in the bind pose, and which bones move it.

The bind pose is the one the skin was made for: bone j stands at B inv(M_j), where M_j is its
inverse bind matrix and B, the same for all bones of a skin, takes the mesh to the world. What
the file's nodes show may be another pose, a step of a walk for one; B is then not quite known
(see ``_mesh_to_world``). Without inverse bind matrices the nodes' pose is the bind pose.
"""
from __future__ import annotations

import contextlib
import itertools
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from ...model import errors
from .accessors import read_floats, read_indices
from .gltf_file import GltfFile, count, nested, objects
from .nodes import Nodes

TRIANGLES, STRIP, FAN = 4, 5, 6
"""Modes of a primitive; others are points and lines."""

LARGEST_SKIN = 500_000
"""Vertices of all meshes together."""


@dataclass(frozen=True)
class Look:
    """Of a mesh of v vertices: ``normals`` (v, 3), ``uvs`` (v, 2), zero where it has none."""

    normals: np.ndarray
    uvs: np.ndarray
    material: object


@dataclass
class Skins:
    """All skinned meshes in the bind pose, the file's axes and units.

    ``rests`` has the matrix (4, 4) of each joint's node, by the node's index; ``vertices`` (v, 3),
    ``triangles`` (t, 3), ``nodes`` (v, k) the node of each influence, ``weights`` (v, k).
    """

    rests: dict[int, np.ndarray] = field(default_factory=dict)
    vertices: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    triangles: np.ndarray = field(default_factory=lambda: np.zeros((0, 3), np.int32))
    nodes: np.ndarray = field(default_factory=lambda: np.zeros((0, 4), np.int32))
    weights: np.ndarray = field(default_factory=lambda: np.zeros((0, 4)))
    normals: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    """(v, 3), of any length; zero where the file has none."""
    uvs: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    materials: list[object] = field(default_factory=list)
    """What the file has as the material of each mesh."""
    meshes: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int32))
    """(t,) of which mesh each triangle is."""
    notes: list[str] = field(default_factory=list)

    def add(self, vertices: np.ndarray, triangles: np.ndarray, nodes: np.ndarray,
            weights: np.ndarray, look: Look) -> None:
        """Append a mesh, its ``triangles`` by its own vertices; OutOfRange for too many."""
        base, width = len(self.vertices), max(nodes.shape[1], self.nodes.shape[1])
        if base + len(vertices) > LARGEST_SKIN:
            raise errors.OutOfRange('meshes', base + len(vertices),
                                    f'at most {LARGEST_SKIN} skinned vertices')
        self.vertices = np.concatenate([self.vertices, vertices])
        self.triangles = np.concatenate([self.triangles, triangles + base])
        self.nodes = np.concatenate([widened(self.nodes, width), widened(nodes, width)])
        self.weights = np.concatenate([widened(self.weights, width), widened(weights, width)])
        self.normals = np.concatenate([self.normals, look.normals])
        self.uvs = np.concatenate([self.uvs, look.uvs])
        self.meshes = np.concatenate([self.meshes, np.full(len(triangles), len(self.materials),
                                                           np.int32)])
        self.materials.append(look.material)


def read_skins(file: GltfFile, nodes: Nodes) -> Skins:
    """Every mesh that a skin moves; a ModelError where one is broken."""
    skins = Skins()
    for index, node in enumerate(file.json['nodes']):
        if node.get('mesh') is None or node.get('skin') is None:
            continue
        joints, inverses = _read_skin(file, node['skin'], f'nodes[{index}].skin')
        _add_rests(skins, nodes, joints, inverses)
        matrices = np.stack([skins.rests[joint] for joint in joints]) @ inverses
        for primitive, where in primitives(file, node, index):
            _add_primitive(file, skins, primitive, joints, matrices, where)
    return skins


def primitives(file: GltfFile, node: dict, index: int) -> Iterator[tuple[dict, str]]:
    """The primitives of the mesh of a node, and where each is in the file."""
    mesh = file.entry('meshes', node['mesh'], f'nodes[{index}].mesh')
    where = f'meshes[{node["mesh"]}]'
    for number, primitive in enumerate(objects(mesh, 'primitives', where)):
        yield primitive, f'{where}.primitives[{number}]'


def primitive_points(file: GltfFile, primitive: dict, where: str) -> np.ndarray:
    """Vertices (v, 3) of a primitive, the mesh's frame and the file's units."""
    attributes = nested(primitive, 'attributes', dict, where)
    if attributes.get('POSITION') is None:
        raise errors.WrongForm(f'{where}.attributes', sorted(attributes), 'POSITION')
    return read_floats(file, attributes['POSITION'], 'VEC3', f'{where}.POSITION')


def _read_skin(file: GltfFile, index: object, where: str) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (j,) of a skin's joints, and their inverse bind matrices (j, 4, 4)."""
    skin, where = file.entry('skins', index, where), f'skins[{index}]'
    joints = nested(skin, 'joints', list, where)
    if not joints:
        raise errors.WrongForm(f'{where}.joints', joints, 'at least one joint')
    for joint in joints:
        file.entry('nodes', joint, f'{where}.joints')
    joints = np.array(joints)
    if skin.get('inverseBindMatrices') is None:
        return joints, np.broadcast_to(np.eye(4), (len(joints), 4, 4))
    where = f'{where}.inverseBindMatrices'
    values = read_floats(file, skin['inverseBindMatrices'], 'MAT4', where)
    if len(values) < len(joints):
        raise errors.OutOfRange(where, len(values), f'{len(joints)} matrices, one for each joint')
    inverses = values[:len(joints)].reshape(-1, 4, 4).transpose(0, 2, 1).copy()
    # Exact in the specification; what exporters write there is noise.
    inverses[:, 3] = (0, 0, 0, 1)
    singular = np.abs(np.linalg.det(inverses)) < 1e-30
    if singular.any():
        raise errors.WrongForm(f'{where}[{int(np.argmax(singular))}]', 'a matrix of determinant 0',
                               'matrices that have an inverse')
    return joints, inverses


def _add_rests(skins: Skins, nodes: Nodes, joints: np.ndarray, inverses: np.ndarray) -> None:
    """Place the joints of a skin in the bind pose; a joint that stands already stays."""
    known = [k for k, joint in enumerate(joints) if int(joint) in skins.rests]
    if (inverses == np.eye(4)).all():
        rests = nodes.worlds[joints]
    elif known:
        rests = skins.rests[int(joints[known[0]])] @ inverses[known[0]] @ np.linalg.inv(inverses)
    else:
        rests = _mesh_to_world(skins, nodes, joints, inverses) @ np.linalg.inv(inverses)
    for joint, rest in zip(joints, rests, strict=True):
        skins.rests.setdefault(int(joint), rest)


def _mesh_to_world(skins: Skins, nodes: Nodes, joints: np.ndarray,
                   inverses: np.ndarray) -> np.ndarray:
    """Matrix (4, 4) that takes a mesh in its bind pose to the world.

    Every joint says world_j M_j. They agree when the nodes stand in the bind pose. If not, the
    topmost joint's is taken, rotated to the nearest of the 24 upright orientations: a hip in the
    middle of a step is a few degrees off, a change of axes is a multiple of 90.
    """
    said = nodes.worlds[joints] @ inverses
    top = min(range(len(joints)), key=lambda k: nodes.order.index(joints[k]))
    size = np.abs(said[top]).max()
    if not np.isfinite(said[top]).all() or not np.abs(np.linalg.det(said[top])) > 1e-30:
        raise errors.WrongForm('nodes', 'a scale of zero or without end',
                               'nodes that leave the skin a size')
    if np.abs(said - said[top]).max() < 1e-3 * size:
        return said[top]
    skins.notes.append('the nodes stand in another pose than the one the skin was bound in; '
                       'the bind pose is taken')
    linear = said[top, :3, :3]
    scale = np.cbrt(np.abs(np.linalg.det(linear)))
    matrix = said[top].copy()
    matrix[:3, :3] = scale * _nearest_upright(linear / scale)
    return matrix


def _nearest_upright(matrix: np.ndarray) -> np.ndarray:
    """Of the 24 rotations that map axes to axes, the one nearest to a matrix (3, 3)."""
    permutations = [np.eye(3)[list(p)] for p in itertools.permutations(range(3))]
    signs = [np.diag(s) for s in itertools.product((1.0, -1.0), repeat=3)]
    proper = [p @ s for p in permutations for s in signs if np.linalg.det(p @ s) > 0]
    return max(proper, key=lambda candidate: float(np.sum(candidate * matrix)))


def _add_primitive(file: GltfFile, skins: Skins, primitive: dict, joints: np.ndarray,
                   matrices: np.ndarray, where: str) -> None:
    points = primitive_points(file, primitive, where)
    attributes, slots, weights = primitive['attributes'], [], []
    for number in itertools.count():
        if attributes.get(f'JOINTS_{number}') is None:
            break
        label = f'{where}.JOINTS_{number}'
        slots.append(read_indices(file, attributes[f'JOINTS_{number}'], 'VEC4', 1 << 16, label))
        label = f'{where}.WEIGHTS_{number}'
        weights.append(read_floats(file, attributes.get(f'WEIGHTS_{number}'), 'VEC4', label))
    if not slots:
        skins.notes.append(f'{where} has no JOINTS_0: left out')
        return
    if any(len(part) != len(points) for part in (*slots, *weights)):
        raise errors.WrongForm(where, 'attributes of different length', f'{len(points)} of each')
    slot, weight = np.concatenate(slots, axis=1), np.concatenate(weights, axis=1)
    weight = np.maximum(weight, 0)
    # A slot without weight may hold anything.
    used = np.where(weight > 0, slot, 0)
    if (used >= len(joints)).any():
        raise errors.OutOfRange(f'{where}.JOINTS', int(used.max()),
                                f'an index from 0 to {len(joints) - 1} in skins.joints')
    total = weight.sum(axis=1, keepdims=True)
    weight = np.divide(weight, total, out=np.zeros_like(weight), where=total > 0)
    vertices = _skinned(points, used, weight, matrices)
    triangles = triangles_of(file, primitive, len(points), where)
    look = look_of(file, primitive, len(points), where)
    normals = _skinned(points + look.normals, used, weight, matrices) - vertices
    skins.add(vertices, triangles, joints[used].astype(np.int32), weight,
              replace(look, normals=normals))


def look_of(file: GltfFile, primitive: dict, points: int, where: str) -> Look:
    """What a primitive of so many vertices looks like; what is broken in that, it has not."""
    found = []
    for name, kind, width in (('NORMAL', 'VEC3', 3), ('TEXCOORD_0', 'VEC2', 2)):
        values = np.zeros((points, width))
        index = primitive['attributes'].get(name)
        with contextlib.suppress(errors.ModelError):
            read = values if index is None else read_floats(file, index, kind, f'{where}.{name}')
            if read.shape == values.shape:
                values = np.clip(read, -1e6, 1e6)
        found.append(values)
    return Look(*found, primitive.get('material'))


def _skinned(points: np.ndarray, slots: np.ndarray, weights: np.ndarray,
             matrices: np.ndarray) -> np.ndarray:
    """Vertices in the bind pose, world: sum of w_j R_j M_j v; unweighted ones go with joint 0."""
    if np.abs(matrices - matrices[0]).max() <= 1e-6 * np.abs(matrices[0]).max():
        return points @ matrices[0, :3, :3].T + matrices[0, :3, 3]
    weights = np.where(weights.sum(axis=1, keepdims=True) > 0, weights, [1] + [0] * (
        weights.shape[1] - 1))
    vertices = np.zeros_like(points)
    for slot, weight in zip(slots.T, weights.T, strict=True):
        moved = np.einsum('vij,vj->vi', matrices[slot, :3, :3], points) + matrices[slot, :3, 3]
        vertices += weight[:, None] * moved
    return vertices


def triangles_of(file: GltfFile, primitive: dict, points: int, where: str) -> np.ndarray:
    """Triangles (t, 3) of a primitive with so many points; none of one of points or lines."""
    mode = count(primitive, 'mode', where, TRIANGLES)
    if mode not in (TRIANGLES, STRIP, FAN):
        return np.zeros((0, 3), np.int32)
    if primitive.get('indices') is None:
        corners = np.arange(points, dtype=np.int32)
    else:
        corners = read_indices(file, primitive['indices'], 'SCALAR', points,
                               f'{where}.indices')[:, 0]
    if mode == TRIANGLES:
        return corners[:len(corners) // 3 * 3].reshape(-1, 3)
    if len(corners) < 3:
        return np.zeros((0, 3), np.int32)
    first = corners[:-2] if mode == STRIP else np.full(len(corners) - 2, corners[0])
    strip = np.stack([first, corners[1:-1], corners[2:]], axis=1)
    if mode == STRIP:
        # Every other triangle of a strip is wound the other way.
        strip[1::2] = strip[1::2][:, [1, 0, 2]]
    return strip


def widened(array: np.ndarray, width: int) -> np.ndarray:
    """Influences (v, k) with zeros up to ``width`` for each vertex."""
    return np.pad(array, ((0, 0), (0, width - array.shape[1])))
