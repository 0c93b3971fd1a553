"""Arrays out of a glTF file: strides, sparse accessors, normalised integers.

As in sections 3.6.2 and 3.11 of the glTF 2.0 specification.
"""
from __future__ import annotations

import numpy as np

from ..model import errors
from .gltf_file import GltfFile, count, item

LARGEST_COUNT = {'SCALAR': 3_000_000}
"""Elements in one array, by type: a skin of a million triangles has three million indices."""

LARGEST_OTHER = 500_000
"""The same for every other type: vertices."""

COMPONENTS = {5120: np.dtype('<i1'), 5121: np.dtype('<u1'), 5122: np.dtype('<i2'),
              5123: np.dtype('<u2'), 5125: np.dtype('<u4'), 5126: np.dtype('<f4')}

WIDTHS = {'SCALAR': 1, 'VEC2': 2, 'VEC3': 3, 'VEC4': 4, 'MAT4': 16}


def read_floats(file: GltfFile, index: object, kind: str, where: str) -> np.ndarray:
    """Read an accessor as (count, width) float64; NotFinite where a number is not finite."""
    values = _read(file, index, kind, where)
    if not np.isfinite(values).all():
        bad = values[~np.isfinite(values)][0]
        raise errors.NotFinite(where, float(bad), 'finite numbers')
    return values.astype(float)


def read_indices(file: GltfFile, index: object, kind: str, limit: int, where: str) -> np.ndarray:
    """Read an accessor as (count, width) indices, each below ``limit``."""
    values = _read(file, index, kind, where)
    if values.dtype.kind == 'f':
        raise errors.WrongForm(where, 'floats', 'whole numbers')
    values = values.astype(np.int32)
    outside = (values < 0) | (values >= limit)
    if outside.any():
        raise errors.OutOfRange(where, int(values[outside][0]), f'an index from 0 to {limit - 1}')
    return values


def _read(file: GltfFile, index: object, kind: str, where: str) -> np.ndarray:
    accessor = item(file.document.accessors, index, where, 'accessors')
    place = f'accessors[{index}]'
    if accessor.type != kind:
        raise errors.WrongForm(f'{place}.type', accessor.type, kind)
    number = count(accessor.count, f'{place}.count')
    most = LARGEST_COUNT.get(accessor.type, LARGEST_OTHER)
    if number > most:
        raise errors.OutOfRange(f'{place}.count', number, f'at most {most}')
    width = WIDTHS[accessor.type]
    if accessor.bufferView is None:
        values = np.zeros((number, width), _dtype(accessor, place))
    else:
        values = _strided(file, accessor, number, width, place)
    if accessor.sparse is not None:
        values = _substituted(file, accessor, values, place)
    return _normalised(values) if accessor.normalized else values


def _strided(file: GltfFile, accessor: object, number: int, width: int, place: str) -> np.ndarray:
    dtype = _dtype(accessor, place)
    view = item(file.document.bufferViews, accessor.bufferView, place, 'bufferViews')
    element = dtype.itemsize * width
    stride = count(view.byteStride or 0, f'{place}.byteStride') or element
    if stride < element or stride > 252:
        raise errors.OutOfRange(f'bufferViews[{accessor.bufferView}].byteStride', stride,
                                f'{element} to 252')
    if number == 0:
        return np.zeros((0, width), dtype)
    start = count(accessor.byteOffset or 0, f'{place}.byteOffset')
    data = file.read(accessor.bufferView, start, stride * (number - 1) + element, place)
    return np.ndarray((number, width), dtype, data, strides=(stride, dtype.itemsize))


def _substituted(file: GltfFile, accessor: object, values: np.ndarray, place: str) -> np.ndarray:
    sparse, place = accessor.sparse, f'{place}.sparse'
    if sparse.indices is None or sparse.values is None:
        raise errors.WrongForm(place, None, 'indices and values')
    number = count(sparse.count, f'{place}.count')
    if number > len(values):
        raise errors.OutOfRange(f'{place}.count', number, f'at most {len(values)}')
    dtype = _dtype(sparse.indices, f'{place}.indices')
    data = file.read(sparse.indices.bufferView, count(sparse.indices.byteOffset or 0, place),
                     number * dtype.itemsize, f'{place}.indices')
    at = np.frombuffer(data, dtype)
    if dtype.kind != 'u' or (at >= len(values)).any():
        raise errors.OutOfRange(f'{place}.indices', 'an index', f'from 0 to {len(values) - 1}')
    data = file.read(sparse.values.bufferView, count(sparse.values.byteOffset or 0, place),
                     number * values.shape[1] * values.itemsize, f'{place}.values')
    values = values.copy()
    values[at] = np.frombuffer(data, values.dtype).reshape(number, values.shape[1])
    return values


def _dtype(accessor: object, place: str) -> np.dtype:
    kind = accessor.componentType
    if not isinstance(kind, int) or kind not in COMPONENTS:
        expected = 'one of ' + ', '.join(map(str, COMPONENTS))
        raise errors.WrongForm(f'{place}.componentType', kind, expected)
    return COMPONENTS[kind]


def _normalised(values: np.ndarray) -> np.ndarray:
    """Integers as fractions of their largest value; the lowest of a signed kind is -1 too."""
    if values.dtype.kind == 'f':
        return values
    return np.maximum(values / np.iinfo(values.dtype).max, -1.0)
