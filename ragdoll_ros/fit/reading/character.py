"""A rigged, skinned character in REP 103 axes: x forward, y left, z up; metres."""
import functools
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...files.bone_names.names import side_of
from ...files.gltf.bones import names_of_nodes, unique_names
from ...files.gltf.gltf_file import GltfFile
from ...files.gltf.nodes import TO_ROS, Nodes, read_nodes
from ...model import errors, rotation
from ...model.skeleton import Appearance
from .draco import decompress
from .materials import Materials
from .other_formats import refuse_other_formats
from .rigid_meshes import add_rigid_meshes
from .scale import metres_per_unit
from .skins import Skins, read_skins
from .spring_bones import (
    SpringBone,
    drop_short_segments,
    node_matrix,
    read_springs,
    with_points,
)
from .spring_colliders import placed, transformed

MAX_BONES = 1500
"""A detailed face has about 900."""


@dataclass(frozen=True)
class Character:
    """Bones (n, parents first) and skin (v vertices, t triangles) in the bind pose."""

    name: str
    bone_names: tuple[str, ...]
    parents: tuple[int, ...]
    """Index of each bone's parent, -1 for a bone without one."""
    positions: np.ndarray
    """(n, 3) m, the origin of each bone."""
    orientations: np.ndarray
    """(n, 4) xyzw, the axes of each bone in the file."""
    vertices: np.ndarray
    """(v, 3) m."""
    triangles: np.ndarray
    """(t, 3) vertex indices."""
    bones: np.ndarray
    """(v, k) bone indices of each vertex's influences."""
    weights: np.ndarray
    """(v, k) skin weights of the influences; a row's sum is 1, or 0 for an unweighted vertex."""
    scale: float = 1.0
    """Metres per unit of the file."""
    notes: tuple[str, ...] = ()
    """Warnings: what could not be imported as it is in the file."""
    springs: tuple[SpringBone, ...] = ()
    """Spring bones; their points are in m, the character's frame."""
    appearance: Appearance | None = None
    """Appearance of the surface; None where the file has neither materials nor normals."""

    @functools.cached_property
    def extent(self) -> float:
        """Longest edge of the skin's bounding box, m."""
        return float(np.ptp(self.vertices, axis=0).max())

    def vertex_areas(self) -> np.ndarray:
        """Area (v,) m^2 of each vertex: a third of its triangles'."""
        return np.bincount(self.triangles.ravel(), np.repeat(self.corner_areas(), 3),
                           len(self.vertices))

    def corner_areas(self) -> np.ndarray:
        """A third (t,) m^2 of each triangle's area."""
        corners = self.vertices[self.triangles]
        return np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0],
                                       corners[:, 2] - corners[:, 0]), axis=1) / 6

    def volume(self) -> float:
        """Volume inside the skin, m^3, by the divergence theorem; exact for a closed skin."""
        corners = self.vertices[self.triangles] - self.vertices.mean(axis=0)
        return float(abs(np.einsum('ti,ti->', corners[:, 0],
                                   np.cross(corners[:, 1], corners[:, 2])) / 6))


def read_character(path: str | Path, scale: float | None = None) -> Character:
    """Character of a .glb or .gltf file.

    ``scale`` is metres per unit of the file; None: 1, or an estimate with a note, see scale.py.
    Raises ModelErrors with the fault of the file.
    """
    if scale is not None:
        errors.check_positive('scale', scale)
    try:
        refuse_other_formats(Path(path))
        file = decompress(GltfFile(path))
        # Overflow shows in the results, which are checked.
        with np.errstate(over='ignore', invalid='ignore'):
            nodes = read_nodes(file)
            skins = read_skins(file, nodes)
            add_rigid_meshes(file, nodes, skins)
        if len(skins.vertices) == 0:
            raise errors.WrongForm('meshes', 0, 'a skin with vertices')
        return _character(file, nodes, skins, scale)
    except errors.ModelError as error:
        raise errors.ModelErrors(str(path), [error]) from None
    except OSError as error:
        error = errors.Unreadable('', error.strerror or str(error), 'a file that can be read')
        raise errors.ModelErrors(str(path), [error]) from None


def _character(file: GltfFile, nodes: Nodes, skins: Skins, scale: float | None) -> Character:
    joints = [node for node in nodes.order if node in skins.bind_matrices]
    if len(joints) > MAX_BONES:
        raise errors.OutOfRange('skins', len(joints), f'at most {MAX_BONES} joints')
    place = {node: bone for bone, node in enumerate(joints)}
    lookup = np.zeros(len(nodes.order), np.int32)
    lookup[joints] = range(len(joints))
    bind_matrices = np.stack([skins.bind_matrices[node] for node in joints])
    if not np.isfinite(skins.vertices).all() or not np.isfinite(bind_matrices).all():
        raise errors.NotFinite('meshes', 'vertices in the bind pose', 'finite numbers')
    names = names_of_nodes(file, joints)
    notes = list(skins.notes)
    axes = TO_ROS
    positions, vertices = bind_matrices[:, :3, 3] @ axes.T, skins.vertices @ axes.T
    # A bone keeps its axes from the file, so that its inverse bind matrix applies.
    linear = axes @ bind_matrices[:, :3, :3]
    yaw = yaw_to_front(names, positions)
    if yaw:
        notes.append(f'the left limbs show that the character does not face +Z: turned by {yaw} '
                     'degrees')
        upright = np.round(rotation.matrix(rotation.from_axis_angle((0, 0, 1), np.radians(yaw))))
        positions, vertices, linear = positions @ upright.T, vertices @ upright.T, upright @ linear
        axes = upright @ axes
    parents = tuple(_parent_bone(node, nodes, place) for node in joints)
    metres = metres_per_unit(names, parents, positions, vertices, notes) if scale is None else scale
    springs = _springs(file, nodes, skins, place, metres * axes, notes)
    appearance = _read_appearance(file, skins, axes, notes)
    stem = unique_names([file.path.stem], 'bone')[0]
    return Character(
        stem, names, parents,
        positions * metres, np.stack([rotation.nearest_rotation(matrix) for matrix in linear]),
        vertices * metres, skins.triangles, lookup[skins.nodes], skins.weights, metres,
        tuple(notes), springs, appearance)


def _read_appearance(file: GltfFile, skins: Skins, axes: np.ndarray,
                     notes: list[str]) -> Appearance | None:
    """Appearance of the surface; ``axes`` (3, 3) rotate normals to the character's frame."""
    materials = Materials(file, notes)
    numbers = np.array([materials.number(each) for each in skins.materials], int)
    if not materials.entries and not skins.normals.any():
        return None
    normals = skins.normals @ axes.T
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 1e-30)
    return Appearance(np.nan_to_num(normals), skins.uvs, numbers[skins.meshes],
                      tuple(materials.entries), tuple(materials.textures))


def _springs(file: GltfFile, nodes: Nodes, skins: Skins, place: dict[int, int],
             matrix: np.ndarray, notes: list[str]) -> tuple[SpringBone, ...]:
    """Spring bones of the character; ``matrix`` (3, 3) transforms points of the file to
    its frame.
    """
    found = []
    for spring in read_springs(file, nodes, notes):
        carrier = _parent_bone(spring.nodes[0], nodes, place)
        if carrier < 0:
            notes.append(f'spring {spring.name} has no bone above it: ignored')
            continue
        spring = with_points(spring, nodes, skins.bind_matrices)
        # The last node of VRM 1.0 ends the last segment.
        links = {place[node]: min(number, len(spring.joints) - 1)
                 for number, node in enumerate(spring.nodes) if node in place}
        colliders = [placed(collider, node_matrix(collider.node, nodes, skins.bind_matrices),
                            place.get(nodes.nearest(collider.node, place), -1))
                     for collider in spring.colliders]
        found.append(drop_short_segments(replace(
            spring, points=spring.points @ matrix.T, carrier=carrier, bones=tuple(links),
            links=tuple(links.values()), colliders=tuple(
                transformed(collider, matrix) for collider in colliders
                if collider.bone >= 0)), notes))
    found = [spring for spring in found if spring.joints]
    names = unique_names([spring.name for spring in found], 'bone')
    return tuple(replace(spring, name=name) for spring, name in zip(found, names, strict=True))


def _parent_bone(node: int, nodes: Nodes, place: dict[int, int]) -> int:
    """Bone of the nearest ancestor node that is a bone, -1 if there is none."""
    return place.get(nodes.nearest(nodes.parents[node], place), -1)


def yaw_to_front(names: tuple[str, ...], positions: np.ndarray) -> int:
    """Yaw, degrees, in steps of 90, that turns the bones named left to +y."""
    sides = np.array([side_of(name) for name in names])
    if not (sides > 0).any() or not (sides < 0).any():
        return 0
    left = positions[sides > 0].mean(axis=0) - positions[sides < 0].mean(axis=0)
    reach = np.abs(left[:2]).max()
    if reach < 0.02 * np.ptp(positions, axis=0).max():
        return 0
    return round(float(np.degrees(np.arctan2(left[0], left[1]))) / 90) % 4 * 90
