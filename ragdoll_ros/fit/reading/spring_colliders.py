"""Colliders of VRM spring bones: spheres, and capsules of VRMC_springBone 1.0, fixed to nodes."""
from dataclasses import dataclass, replace

import numpy as np

from ...files.gltf.gltf_file import GltfFile, get_container, get_objects
from ...model import errors
from ...model.swing import COLLIDER_RADIUS_RANGE

LARGEST = 1e6
"""Of coordinates and radii, units of the file."""


@dataclass(frozen=True)
class SpringCollider:
    """A sphere or a capsule on a ``node`` that the joints of a spring do not enter."""

    node: int
    axis: np.ndarray
    """Ends of its axis, (2, 3), equal for a sphere: the node's frame; with ``bone`` the file's; of
    a character, m."""
    radius: float
    bone: int = -1
    """The character's bone that it is fixed to."""


def read_new_colliders(file: GltfFile, data: dict, where: str,
                       notes: list[str]) -> list[tuple[SpringCollider, ...]]:
    """The colliders of each collider group of VRMC_springBone. Raises a ModelError."""
    colliders: list[tuple[SpringCollider, ...]] = []
    for number, entry in enumerate(get_objects(data, 'colliders', where)):
        place = f'{where}.colliders[{number}]'
        file.entry('nodes', entry.get('node'), f'{place}.node')
        shape = get_container(entry, 'shape', dict, place)
        kind = next((kind for kind in ('sphere', 'capsule') if kind in shape), None)
        if kind is None:
            notes.append(f'collider {number} is neither a sphere nor a capsule: ignored')
            colliders.append(())
            continue
        place, sizes = f'{place}.shape.{kind}', get_container(shape, kind, dict, f'{place}.shape')
        offset = _vector(sizes.get('offset'), f'{place}.offset')
        tail = _vector(sizes.get('tail'), f'{place}.tail') if kind == 'capsule' else offset
        colliders.append((SpringCollider(entry['node'], np.array([offset, tail]),
                                         _radius(sizes, place)),))
    return [sum((colliders[index] for index in _indices(
        entry, 'colliders', colliders, f'{where}.colliderGroups[{number}]')), ())
        for number, entry in enumerate(get_objects(data, 'colliderGroups', where))]


def read_old_colliders(file: GltfFile, data: dict,
                       where: str) -> list[tuple[SpringCollider, ...]]:
    """The colliders of each collider group of VRM 0.x. Raises a ModelError."""
    groups = []
    for number, entry in enumerate(get_objects(data, 'colliderGroups', where)):
        place = f'{where}.colliderGroups[{number}]'
        found = []
        for index, each in enumerate(get_objects(entry, 'colliders', place)):
            file.entry('nodes', entry.get('node'), f'{place}.node')
            inner = f'{place}.colliders[{index}]'
            given = get_container(each, 'offset', dict, inner)
            # Exporters write offsets in Unity's left-handed axes, with z reversed.
            offset = _vector([given.get(axis, 0.0) for axis in 'xyz'],
                             f'{inner}.offset') * (1, 1, -1)
            found.append(SpringCollider(entry['node'], np.array([offset, offset]),
                                        _radius(each, inner)))
        groups.append(tuple(found))
    return groups


def colliders_of(entry: dict, groups: list[tuple[SpringCollider, ...]],
                 where: str) -> tuple[SpringCollider, ...]:
    """Colliders of the groups that a spring or bone group names, each once."""
    named = _indices(entry, 'colliderGroups', groups, where)
    return sum((groups[index] for index in dict.fromkeys(named)), ())


def placed(collider: SpringCollider, matrix: np.ndarray, bone: int) -> SpringCollider:
    """The collider in the frame of ``matrix`` (4, 4), its node's transform in the bind pose, fixed
    to a character's ``bone``.
    """
    axis = collider.axis @ matrix[:3, :3].T + matrix[:3, 3]
    scale = float(np.cbrt(abs(np.linalg.det(matrix[:3, :3]))))
    if not np.isfinite(axis).all() or not np.isfinite(scale):
        raise errors.NotFinite(f'nodes[{collider.node}]', 'a collider', 'finite positions')
    return replace(collider, axis=axis, radius=collider.radius * scale, bone=bone)


def transformed(collider: SpringCollider, matrix: np.ndarray) -> SpringCollider:
    """The collider in a character's frame, in m; ``matrix`` (3, 3) transforms points to
    that frame.
    """
    scale = float(np.cbrt(abs(np.linalg.det(matrix))))
    return replace(collider, axis=collider.axis @ matrix.T, radius=collider.radius * scale)


def has_size(collider: SpringCollider) -> bool:
    """Whether the radius of a character's collider is in the range allowed for a swing's
    colliders.
    """
    low, high = COLLIDER_RADIUS_RANGE
    return low <= collider.radius <= high


def _indices(entry: dict, key: str, entries: list, where: str) -> list[int]:
    found = get_container(entry, key, list, where)
    for index in found:
        if type(index) is not int or not 0 <= index < len(entries):
            raise errors.OutOfRange(f'{where}.{key}', index,
                                    f'an index from 0 to {len(entries) - 1}')
    return found


def _radius(entry: dict, where: str) -> float:
    value = entry.get('radius', 0.0)
    if type(value) not in (int, float) or not 0 <= value <= LARGEST:
        raise errors.OutOfRange(f'{where}.radius', value, f'a number from 0 to {LARGEST:g}')
    return float(value)


def _vector(value: object, where: str) -> np.ndarray:
    value = [0.0, 0.0, 0.0] if value is None else value
    if not isinstance(value, list) or len(value) != 3 or not all(
            type(part) in (int, float) and abs(part) <= LARGEST for part in value):
        raise errors.WrongForm(where, value, f'3 numbers up to {LARGEST:g}')
    return np.array(value, float)
