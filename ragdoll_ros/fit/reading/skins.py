"""Skinned meshes of a glTF file in the bind pose, with their influences."""
import contextlib
import itertools
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from ...files.gltf.accessors import read_floats, read_indices, read_numbers
from ...files.gltf.bind_poses import add_bind_matrices, read_skin
from ...files.gltf.gltf_file import GltfFile, get_container, get_count, get_objects
from ...files.gltf.nodes import Nodes
from ...model import errors

TRIANGLES, STRIP, FAN = 4, 5, 6
"""Modes of a primitive; all others are points and lines."""

MAX_VERTICES = 500_000
"""Vertices of all meshes in total."""


@dataclass(frozen=True)
class PrimitiveAppearance:
    """Normals (v, 3) and texture coordinates (v, 2) of a mesh, zero where missing; material."""

    normals: np.ndarray
    uvs: np.ndarray
    material: object


@dataclass
class Skins:
    """All skinned meshes in the bind pose, the file's axes and units.

    ``bind_matrices`` are the transforms (4, 4) of the joints' nodes, by node index; ``vertices``
    (v, 3), ``triangles`` (t, 3), ``nodes`` (v, k) of the influences, ``weights`` (v, k).
    """

    bind_matrices: dict[int, np.ndarray] = field(default_factory=dict)
    vertices: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    triangles: np.ndarray = field(default_factory=lambda: np.zeros((0, 3), np.int32))
    nodes: np.ndarray = field(default_factory=lambda: np.zeros((0, 4), np.int32))
    weights: np.ndarray = field(default_factory=lambda: np.zeros((0, 4)))
    normals: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    """(v, 3), not normalized; zero where the file has none."""
    uvs: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    materials: list[object] = field(default_factory=list)
    """Material of each mesh, as in the file."""
    meshes: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int32))
    """(t,) index of each triangle's mesh."""
    notes: list[str] = field(default_factory=list)

    def add(self, vertices: np.ndarray, triangles: np.ndarray, nodes: np.ndarray,
            weights: np.ndarray, appearance: PrimitiveAppearance) -> None:
        """Append a mesh; ``triangles`` index its own vertices. OutOfRange for too many vertices."""
        base, width = len(self.vertices), max(nodes.shape[1], self.nodes.shape[1])
        if base + len(vertices) > MAX_VERTICES:
            raise errors.OutOfRange('meshes', base + len(vertices),
                                    f'at most {MAX_VERTICES} skinned vertices')
        self.vertices = np.concatenate([self.vertices, vertices])
        self.triangles = np.concatenate([self.triangles, triangles + base])
        self.nodes, self.weights = (
            np.concatenate([pad_influences(old, width), pad_influences(new, width)])
            for old, new in ((self.nodes, nodes), (self.weights, weights)))
        self.normals = np.concatenate([self.normals, appearance.normals])
        self.uvs = np.concatenate([self.uvs, appearance.uvs])
        self.meshes = np.concatenate([self.meshes, np.full(len(triangles), len(self.materials),
                                                           np.int32)])
        self.materials.append(appearance.material)


def read_skins(file: GltfFile, nodes: Nodes) -> Skins:
    """All skinned meshes; raises a ModelError for a broken one."""
    skins = Skins()
    for index, node in enumerate(file.json['nodes']):
        if node.get('mesh') is None or node.get('skin') is None:
            continue
        joints, inverses = read_skin(file, node['skin'], f'nodes[{index}].skin')
        add_bind_matrices(skins.bind_matrices, nodes, joints, inverses, skins.notes)
        matrices = np.stack([skins.bind_matrices[joint] for joint in joints]) @ inverses
        for primitive, where in primitives(file, node, index):
            _add_primitive(file, skins, primitive, joints, matrices, where)
    return skins


def primitives(file: GltfFile, node: dict, index: int) -> Iterator[tuple[dict, str]]:
    """Primitives of a node's mesh, each with its path in the file."""
    mesh = file.entry('meshes', node['mesh'], f'nodes[{index}].mesh')
    where = f'meshes[{node["mesh"]}]'
    for number, primitive in enumerate(get_objects(mesh, 'primitives', where)):
        yield primitive, f'{where}.primitives[{number}]'


def read_positions(file: GltfFile, primitive: dict, where: str) -> np.ndarray:
    """Vertices (v, 3) of a primitive, in the mesh's frame and the file's units."""
    attributes = get_container(primitive, 'attributes', dict, where)
    if attributes.get('POSITION') is None:
        raise errors.WrongForm(f'{where}.attributes', sorted(attributes), 'POSITION')
    return read_floats(file, attributes['POSITION'], 'VEC3', f'{where}.POSITION')


def _add_primitive(file: GltfFile, skins: Skins, primitive: dict, joints: np.ndarray,
                   matrices: np.ndarray, where: str) -> None:
    points = read_positions(file, primitive, where)
    attributes, slots, weights = primitive['attributes'], [], []
    for number in itertools.count():
        if attributes.get(f'JOINTS_{number}') is None:
            break
        label = f'{where}.JOINTS_{number}'
        slots.append(read_indices(file, attributes[f'JOINTS_{number}'], 'VEC4', 1 << 16, label))
        label = f'{where}.WEIGHTS_{number}'
        weights.append(read_numbers(file, attributes.get(f'WEIGHTS_{number}'), 'VEC4', label))
    if not slots:
        skins.notes.append(f'{where} has no JOINTS_0: ignored')
        return
    if any(len(part) != len(points) for part in (*slots, *weights)):
        raise errors.WrongForm(where, 'attributes of different length', f'{len(points)} of each')
    slot, weight = np.concatenate(slots, axis=1), np.concatenate(weights, axis=1)
    bad = ~np.isfinite(weight)
    if count := int(bad.any(axis=1).sum()):
        skins.notes.append(f'{where}: weights of {count} of {len(points)} vertices are no numbers: '
                           'taken as 0')
    weight = np.where(bad, 0, np.maximum(weight, 0))
    # Joint indices with zero weight may be invalid.
    used = np.where(weight > 0, slot, 0)
    if (used >= len(joints)).any():
        raise errors.OutOfRange(f'{where}.JOINTS', int(used.max()),
                                f'an index from 0 to {len(joints) - 1} in skins.joints')
    total = weight.sum(axis=1, keepdims=True)
    weight = np.divide(weight, total, out=np.zeros_like(weight), where=total > 0)
    vertices = _skin_vertices(points, used, weight, matrices)
    triangles = read_triangles(file, primitive, len(points), where)
    appearance = read_appearance(file, primitive, len(points), where)
    normals = _skin_vertices(points + appearance.normals, used, weight, matrices) - vertices
    skins.add(vertices, triangles, joints[used].astype(np.int32), weight,
              replace(appearance, normals=normals))


def read_appearance(file: GltfFile, primitive: dict, points: int,
                    where: str) -> PrimitiveAppearance:
    """Appearance of a primitive with ``points`` vertices; broken attributes count as missing."""
    found = []
    for name, kind, width in (('NORMAL', 'VEC3', 3), ('TEXCOORD_0', 'VEC2', 2)):
        values = np.zeros((points, width))
        index = primitive['attributes'].get(name)
        with contextlib.suppress(errors.ModelError):
            read = values if index is None else read_floats(file, index, kind, f'{where}.{name}')
            if read.shape == values.shape:
                values = np.clip(read, -1e6, 1e6)
        found.append(values)
    return PrimitiveAppearance(*found, primitive.get('material'))


def _skin_vertices(points: np.ndarray, slots: np.ndarray, weights: np.ndarray,
                   matrices: np.ndarray) -> np.ndarray:
    """Linear blend skinning to the world frame: sum over joints of weight, matrix and point.

    ``slots`` (v, k) are indices of ``matrices``; unweighted vertices follow joint 0.
    """
    if np.abs(matrices - matrices[0]).max() <= 1e-6 * np.abs(matrices[0]).max():
        return points @ matrices[0, :3, :3].T + matrices[0, :3, 3]
    weights = np.where(weights.sum(axis=1, keepdims=True) > 0, weights, [1] + [0] * (
        weights.shape[1] - 1))
    vertices = np.zeros_like(points)
    for slot, weight in zip(slots.T, weights.T, strict=True):
        moved = np.einsum('vij,vj->vi', matrices[slot, :3, :3], points) + matrices[slot, :3, 3]
        vertices += weight[:, None] * moved
    return vertices


def read_triangles(file: GltfFile, primitive: dict, points: int, where: str) -> np.ndarray:
    """Triangles (t, 3) of a primitive with ``points`` vertices; none for points and lines."""
    mode = get_count(primitive, 'mode', where, TRIANGLES)
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
        # Odd triangles of a strip have the opposite winding.
        strip[1::2] = strip[1::2][:, [1, 0, 2]]
    return strip


def pad_influences(array: np.ndarray, width: int) -> np.ndarray:
    """Influences (v, k) padded with zeros to ``width`` per vertex."""
    return np.pad(array, ((0, 0), (0, width - array.shape[1])))
