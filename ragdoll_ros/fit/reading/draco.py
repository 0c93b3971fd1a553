"""Draco-compressed primitives of a glTF file, decoded by DracoPy from the extra `fit`.

KHR_draco_mesh_compression: the attributes and indices of a primitive are compressed in a buffer
view of their own, and their accessors have none.
"""
from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...files.gltf.accessors import COMPONENT_TYPES
from ...files.gltf.gltf_file import GltfFile, get_container, get_count, get_objects
from ...model import errors

if TYPE_CHECKING:
    from DracoPy import DracoMesh

EXTENSION = 'KHR_draco_mesh_compression'

ATTRIBUTES = ('POSITION', 'JOINTS_', 'WEIGHTS_')
"""Attributes that are decoded; normals, colours and texture coordinates are not."""


def decompress(file: GltfFile) -> GltfFile:
    """The file, with uncompressed buffers for its compressed accessors.

    Raises a ModelError for broken data or where DracoPy is missing.
    """
    for number, mesh in enumerate(file.json['meshes']):
        where = f'meshes[{number}]'
        for index, primitive in enumerate(get_objects(mesh, 'primitives', where)):
            place = f'{where}.primitives[{index}]'
            extensions = get_container(primitive, 'extensions', dict, place)
            compressed = get_container(extensions, EXTENSION, dict, f'{place}.extensions')
            if compressed:
                _decompress_primitive(file, primitive, compressed, place)
    return file


def _decompress_primitive(file: GltfFile, primitive: dict, compressed: dict, where: str) -> None:
    """Store the decoded attributes and indices of a primitive's ``compressed`` extension."""
    place = f'{where}.extensions.{EXTENSION}'
    view = compressed.get('bufferView')
    size = get_count(file.entry('bufferViews', view, place), 'byteLength', f'bufferViews[{view}]')
    mesh = _decode(file.read(view, 0, size, place), place)
    known = {attribute['unique_id']: attribute['data'] for attribute in mesh.attributes}
    accessors = get_container(primitive, 'attributes', dict, where)
    for name, number in get_container(compressed, 'attributes', dict, place).items():
        if name.startswith(ATTRIBUTES):
            if type(number) is not int or number not in known:
                raise errors.OutOfRange(f'{place}.attributes.{name}', number,
                                        f'one of {sorted(known)}')
            _store_values(file, accessors.get(name), known[number], f'{where}.attributes.{name}')
    if primitive.get('indices') is not None:
        _store_values(file, primitive['indices'], mesh.faces.reshape(-1, 1), f'{where}.indices')


def _decode(data: bytes, where: str) -> DracoMesh:
    try:
        import DracoPy
    except ImportError:
        raise errors.Unreadable(where, EXTENSION, (
            "DracoPy to read it: pip install '.[fit]', or a file exported without compression"
        )) from None
    try:
        mesh = DracoPy.decode(data)
    # DracoPy does not validate its input: a broken file may raise anything.
    except Exception as error:
        raise errors.Unreadable(where, f'{type(error).__name__}: {error}',
                                'Draco-compressed bytes') from None
    if not hasattr(mesh, 'faces'):
        raise errors.WrongForm(where, 'points', 'a mesh')
    return mesh


def _store_values(file: GltfFile, index: object, values: np.ndarray, where: str) -> None:
    """Store values (n, width) in a new buffer for an accessor."""
    accessor, place = file.entry('accessors', index, where), f'accessors[{index}]'
    kind = accessor.get('componentType')
    if type(kind) is not int or kind not in COMPONENT_TYPES:
        raise errors.WrongForm(f'{place}.componentType', kind,
                               'one of ' + ', '.join(map(str, COMPONENT_TYPES)))
    if get_count(accessor, 'count', place) != len(values):
        raise errors.WrongForm(f'{place}.count', accessor['count'], f'{len(values)}, as compressed')
    # Values that the accessor's type cannot hold are found by later checks.
    with np.errstate(invalid='ignore'):
        data = values.astype(COMPONENT_TYPES[kind]).tobytes()
    accessor.update(bufferView=file.add_view(data), byteOffset=0)
