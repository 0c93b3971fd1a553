"""Draco-compressed primitives of a glTF file, by DracoPy, which the extra `fit` installs.

As in KHR_draco_mesh_compression: a primitive's attributes and indices lie compressed in a buffer
view of its own, and their accessors have none.
"""
from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...model import errors
from .accessors import COMPONENTS
from .gltf_file import GltfFile, count, nested, objects

if TYPE_CHECKING:
    from DracoPy import DracoMesh

EXTENSION = 'KHR_draco_mesh_compression'

NEEDED = ('POSITION', 'JOINTS_', 'WEIGHTS_')
"""What a character is read from; normals, colours and textures stay as they are."""


def decompressed(file: GltfFile) -> GltfFile:
    """The file, its compressed accessors given buffers of their own.

    A ModelError says what is broken, or that DracoPy is missing.
    """
    for number, mesh in enumerate(file.json['meshes']):
        where = f'meshes[{number}]'
        for index, primitive in enumerate(objects(mesh, 'primitives', where)):
            place = f'{where}.primitives[{index}]'
            extensions = nested(primitive, 'extensions', dict, place)
            packed = nested(extensions, EXTENSION, dict, f'{place}.extensions')
            if packed:
                _expand(file, primitive, packed, place)
    return file


def _expand(file: GltfFile, primitive: dict, packed: dict, where: str) -> None:
    """Give the accessors of a primitive what the extension's object ``packed`` points to."""
    place = f'{where}.extensions.{EXTENSION}'
    view = packed.get('bufferView')
    size = count(file.entry('bufferViews', view, place), 'byteLength', f'bufferViews[{view}]')
    mesh = _decoded(file.read(view, 0, size, place), place)
    known = {attribute['unique_id']: attribute['data'] for attribute in mesh.attributes}
    accessors = nested(primitive, 'attributes', dict, where)
    for name, number in nested(packed, 'attributes', dict, place).items():
        if name.startswith(NEEDED):
            if type(number) is not int or number not in known:
                raise errors.OutOfRange(f'{place}.attributes.{name}', number,
                                        f'one of {sorted(known)}')
            _store(file, accessors.get(name), known[number], f'{where}.attributes.{name}')
    if primitive.get('indices') is not None:
        _store(file, primitive['indices'], mesh.faces.reshape(-1, 1), f'{where}.indices')


def _decoded(data: bytes, where: str) -> DracoMesh:
    try:
        import DracoPy
    except ImportError:
        raise errors.Unreadable(where, EXTENSION, (
            "DracoPy to read it: pip install '.[fit]', or a file exported without compression"
        )) from None
    try:
        mesh = DracoPy.decode(data)
    # Whatever a broken file does to a library that does not check it.
    except Exception as error:
        raise errors.Unreadable(where, f'{type(error).__name__}: {error}',
                                'Draco-compressed bytes') from None
    if not hasattr(mesh, 'faces'):
        raise errors.WrongForm(where, 'points', 'a mesh')
    return mesh


def _store(file: GltfFile, index: object, values: np.ndarray, where: str) -> None:
    """Let an accessor read values (n, width) from a buffer of their own."""
    accessor, place = file.entry('accessors', index, where), f'accessors[{index}]'
    kind = accessor.get('componentType')
    if type(kind) is not int or kind not in COMPONENTS:
        raise errors.WrongForm(f'{place}.componentType', kind,
                               'one of ' + ', '.join(map(str, COMPONENTS)))
    if count(accessor, 'count', place) != len(values):
        raise errors.WrongForm(f'{place}.count', accessor['count'], f'{len(values)}, as compressed')
    # An accessor may say otherwise than what was compressed; what comes of that is checked later.
    with np.errstate(invalid='ignore'):
        data = values.astype(COMPONENTS[kind]).tobytes()
    accessor.update(bufferView=file.add_view(data), byteOffset=0)
