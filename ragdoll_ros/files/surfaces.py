"""Shapes that only static bodies have: planes, meshes, and height fields from numbers, .npy files
and pictures. Also hulls of meshes, one or several, which move as parts of a Compound.
"""
import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ..model import errors
from ..model.compound import Compound
from ..model.mesh import SURFACES, HeightField, Hull, Mesh, Surface
from ..model.plane import Plane
from ..model.shapes import Part
from ..model.vectors import Vector, floats, vector
from .config import config_folder
from .robots.hull_decomposition import read_hulls
from .robots.mesh_file import UNSCALED, convex_hull, find_file, read_hull, read_surface
from .schema import Made

MAX_BYTES = 64_000_000
"""Of a file of heights; a million cells of doubles have 8 MB."""

HULLS = 'hulls'
"""Key of the hulls of a mesh in a shape."""

PICTURES = ('.png', '.tif', '.tiff')


def surface_kind(entry: dict) -> str | None:
    """The kind of the shape of an entry of `bodies:`, if it is a surface or a plane."""
    shape = entry.get('shape')
    return next((kind for kind in (*SURFACES, Plane.kind)
                 if isinstance(shape, dict) and kind in shape), None)


def build_surface(entry: dict, folder: Path) -> Surface | Plane:
    """The surface or plane of an entry; paths are relative to ``folder``. Raises ModelError."""
    kind = surface_kind(entry)
    assert kind
    if kind == Plane.kind:
        return Plane()
    data = entry['shape'][kind]
    try:
        if kind == HeightField.kind:
            return _height_field(data, folder)
        return _mesh(kind, data, folder)
    except errors.ModelError as error:
        raise error.at('shape' if error.path.startswith(kind) else f'shape.{kind}') from None


def build_hull(data: dict, folder: Path) -> Hull:
    """Build the hull of a part of a body; its file is not kept. Raises ModelError."""
    try:
        hull = _mesh(Hull.kind, data, folder)
    except errors.ModelError as error:
        raise error if error.path.startswith(Hull.kind) else error.at(Hull.kind) from None
    assert isinstance(hull, Hull)
    return dataclasses.replace(hull, source=None)


def build_hulls(data: dict, folder: Path) -> Compound:
    """The hulls of a mesh file as one shape. Raises ModelError."""
    return Compound(tuple(map(Part, _read(read_hulls, data, folder))))


def hull_data(hull: Hull) -> dict:
    """A hull as numbers."""
    return {'vertices': hull.vertices.tolist(), 'faces': hull.faces.tolist()}


def surface_data(surface: Surface | Plane) -> dict:
    """A surface or plane in the form of scene.schema.json: its file, or where it has none
    its numbers.
    """
    data: dict[str, Any] = {}
    if isinstance(surface, Plane):
        pass
    elif isinstance(surface, HeightField):
        data['size'] = list(surface.size)
        if surface.source:
            data |= {'heights': surface.source[0], 'scale': surface.source[1]}
        else:
            data['heights'] = surface.heights.tolist()
    elif isinstance(surface, Mesh) and surface.source:
        data = {'file': surface.source[0], 'scale': list(surface.source[1])}
    else:
        vertices, faces = surface.mesh()
        data = {'vertices': vertices.tolist(), 'faces': faces.tolist()}
    return {'shape': {surface.kind: data}}


def _height_field(data: dict, folder: Path) -> HeightField:
    heights, size = data['heights'], floats(data['size'])
    if not isinstance(heights, str):
        if 'scale' in data:
            raise errors.WrongForm('scale', data['scale'], 'heights from a file: numbers are in m')
        return HeightField(heights, size)
    path, scale = _found('heights', heights, folder), data.get('scale', 1.0)
    return HeightField(scale * _read_heights(path), size, source=(str(path), float(scale)))


def _mesh(kind: str, data: dict, folder: Path) -> Mesh:
    """A mesh, or the hull of one."""
    if 'file' not in data:
        if 'scale' in data:
            raise errors.WrongForm('scale', data['scale'], 'a file: vertices are in m')
        if kind == Mesh.kind:
            return Mesh(data['vertices'], data['faces'])
        return Hull(data['vertices'], data['faces']) if 'faces' in data else convex_hull(
            np.array(data['vertices'], float))
    return _read(read_hull if kind == Hull.kind else read_surface, data, folder)


def _read(read: Callable[[Path, Vector], Made], data: dict, folder: Path) -> Made:
    """What ``read`` makes of the file of ``data`` and its scale. Raises ModelError."""
    path, scale = _found('file', data['file'], folder), vector(data.get('scale', UNSCALED))
    try:
        return read(path, scale)
    except errors.ModelError as error:
        raise type(error)(f'file.({path.name})', error.value, error.expected) from None


def _found(key: str, name: str, folder: Path) -> Path:
    path = find_file(name, folder) or find_file(name, config_folder())
    if path is None:
        raise errors.Unreadable(key, name, 'a file: a path from the scene, or package://PACKAGE/PATH')
    return path.resolve()


def _read_heights(path: Path) -> np.ndarray:
    """Heights (rows, columns) of a file, rows along y: of a .npy as they are, of a picture 0 to 1
    from black to white, its lowest row first.
    """
    kind, where = path.suffix.lower(), f'heights.({path.name})'
    if kind != '.npy' and kind not in PICTURES:
        raise errors.Unreadable(where, path.name, 'one of ' + ', '.join(('.npy', *PICTURES)))
    if path.stat().st_size > MAX_BYTES:
        raise errors.Unreadable(where, f'{path.stat().st_size} bytes', f'at most {MAX_BYTES}')
    try:
        if kind == '.npy':
            return np.asarray(np.load(path, allow_pickle=False), float)
        picture = _read_picture(path, where)
    except errors.ModelError:
        raise
    # Readers do not validate their input: a broken file may raise anything.
    except Exception as error:
        said = ' '.join(f'{type(error).__name__}: {error}'.split())
        raise errors.Unreadable(where, said[:100], 'an array of heights') from None
    most = np.iinfo(picture.dtype).max if picture.dtype.kind in 'ui' else 1.0
    return picture[::-1].astype(float) / most


def _read_picture(path: Path, where: str) -> np.ndarray:
    """Grey values (rows, columns) of a picture."""
    try:
        import imageio.v3
    except ImportError:
        raise errors.Unreadable(where, path.name,
                                "imageio to read it: pip install '.[viewer]'") from None
    picture = np.asarray(imageio.v3.imread(path))
    if picture.ndim != 2:
        raise errors.WrongForm(where, f'{picture.ndim} dimensions', 'a greyscale picture')
    return picture
