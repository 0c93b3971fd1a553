"""Accessors of a glTF file as arrays: strides, sparse accessors, normalized integers.

Sections 3.6.2 and 3.11 of the glTF 2.0 specification.
"""
import numpy as np

from ...model import errors
from .gltf_file import GltfFile, get_container, get_count

MAX_SCALARS, MAX_VECTORS = 3_000_000, 500_000
"""Elements of one accessor: a skin of a million triangles has three million indices."""

COMPONENT_TYPES = {5120: np.dtype('<i1'), 5121: np.dtype('<u1'), 5122: np.dtype('<i2'),
                   5123: np.dtype('<u2'), 5125: np.dtype('<u4'), 5126: np.dtype('<f4')}

COMPONENT_COUNTS = {'SCALAR': 1, 'VEC2': 2, 'VEC3': 3, 'VEC4': 4, 'MAT4': 16}


def read_floats(file: GltfFile, index: object, kind: str, where: str) -> np.ndarray:
    """As read_numbers(). Raises NotFinite for a value that is not finite."""
    values = read_numbers(file, index, kind, where)
    if not np.isfinite(values).all():
        bad = values[~np.isfinite(values)][0]
        raise errors.NotFinite(where, float(bad), 'finite numbers')
    return values


def read_numbers(file: GltfFile, index: object, kind: str, where: str) -> np.ndarray:
    """Values (count, width) float64 of an accessor whose type is ``kind`` ('VEC3', ...), finite or
    not. Raises a ModelError for a broken accessor; ``where`` is the field that refers to it.
    """
    return _read(file, index, kind, where).astype(float)


def read_indices(file: GltfFile, index: object, kind: str, limit: int, where: str) -> np.ndarray:
    """Return values (count, width) int32 of an accessor, each in 0 to ``limit`` - 1.

    Raises WrongForm for floats, OutOfRange for a value outside; else as read_numbers().
    """
    values = _read(file, index, kind, where)
    if values.dtype.kind == 'f':
        raise errors.WrongForm(where, 'floats', 'whole numbers')
    values = values.astype(np.int32)
    outside = (values < 0) | (values >= limit)
    if outside.any():
        raise errors.OutOfRange(where, int(values[outside][0]), f'an index from 0 to {limit - 1}')
    return values


def _read(file: GltfFile, index: object, kind: str, where: str) -> np.ndarray:
    accessor = file.entry('accessors', index, where)
    place = f'accessors[{index}]'
    if accessor.get('type') != kind:
        raise errors.WrongForm(f'{place}.type', accessor.get('type'), kind)
    number = get_count(accessor, 'count', place)
    most = MAX_SCALARS if kind == 'SCALAR' else MAX_VECTORS
    if number > most:
        raise errors.OutOfRange(f'{place}.count', number, f'at most {most}')
    if accessor.get('bufferView') is None:
        values = np.zeros((number, COMPONENT_COUNTS[kind]), _dtype(accessor, place))
    else:
        values = _read_strided(file, accessor, number, COMPONENT_COUNTS[kind], place)
    sparse = get_container(accessor, 'sparse', dict, place)
    if sparse:
        values = _apply_sparse(file, sparse, values, f'{place}.sparse')
    return _normalize(values) if accessor.get('normalized') else values


def _read_strided(file: GltfFile, accessor: dict, number: int, width: int,
                  place: str) -> np.ndarray:
    dtype, index = _dtype(accessor, place), accessor['bufferView']
    view = file.entry('bufferViews', index, place)
    element = dtype.itemsize * width
    stride = get_count(view, 'byteStride', f'bufferViews[{index}]', 0) or element
    if stride < element or stride > 252:
        raise errors.OutOfRange(f'bufferViews[{index}].byteStride', stride, f'{element} to 252')
    if number == 0:
        return np.zeros((0, width), dtype)
    start = get_count(accessor, 'byteOffset', place, 0)
    data = file.read(index, start, stride * (number - 1) + element, place)
    return np.ndarray((number, width), dtype, data, strides=(stride, dtype.itemsize))


def _apply_sparse(file: GltfFile, sparse: dict, values: np.ndarray, place: str) -> np.ndarray:
    number = get_count(sparse, 'count', place)
    if number > len(values):
        raise errors.OutOfRange(f'{place}.count', number, f'at most {len(values)}')
    part = get_container(sparse, 'indices', dict, place)
    dtype = _dtype(part, f'{place}.indices')
    at = _read_packed(file, part, dtype, number, f'{place}.indices')
    if dtype.kind != 'u' or (at >= len(values)).any():
        raise errors.OutOfRange(f'{place}.indices', 'an index', f'from 0 to {len(values) - 1}')
    values = values.copy()
    packed = _read_packed(file, get_container(sparse, 'values', dict, place), values.dtype,
                          number * values.shape[1], f'{place}.values')
    values[at] = packed.reshape(-1, values.shape[1])
    return values


def _read_packed(file: GltfFile, part: dict, dtype: np.dtype, number: int,
                 place: str) -> np.ndarray:
    data = file.read(part.get('bufferView'), get_count(part, 'byteOffset', place, 0),
                     number * dtype.itemsize, place)
    return np.frombuffer(data, dtype)


def _dtype(accessor: dict, place: str) -> np.dtype:
    kind = accessor.get('componentType')
    if type(kind) is not int or kind not in COMPONENT_TYPES:
        expected = 'one of ' + ', '.join(map(str, COMPONENT_TYPES))
        raise errors.WrongForm(f'{place}.componentType', kind, expected)
    return COMPONENT_TYPES[kind]


def _normalize(values: np.ndarray) -> np.ndarray:
    """Integers as fractions of the type's maximum; the minimum of a signed type gives -1 too."""
    if values.dtype.kind == 'f':
        return values
    return np.maximum(values / np.iinfo(values.dtype).max, -1.0)
