"""Meshes of robots, STL, OBJ and DAE, read by trimesh, which the extra `fit` installs."""
from __future__ import annotations

import contextlib
import io
import logging
from pathlib import Path

import numpy as np

from ...model import errors

READABLE = ('.stl', '.obj', '.dae')

LARGEST_MESH = 64_000_000
"""Bytes; a scanned robot's largest part has 20 million."""

FARTHEST = 1e5
"""m from the mesh's origin; what is farther out comes from a broken file."""


def read_mesh(path: Path, scale: tuple[float, ...] = (1.0, 1.0, 1.0)) -> np.ndarray:
    """Triangles (t, 3, 3) m of a mesh's file, scaled along each axis.

    Unreadable with the reason where there are none.
    """
    kind = path.suffix.lower()
    if kind not in READABLE:
        raise errors.Unreadable('', path.name, 'one of ' + ', '.join(READABLE))
    size = path.stat().st_size
    if size > LARGEST_MESH:
        raise errors.Unreadable('', f'{size} bytes', f'at most {LARGEST_MESH}')
    try:
        import trimesh
    except ImportError:
        raise errors.Unreadable('', path.name, "trimesh to read it: pip install '.[fit]'") from None
    # It warns of what it reads over on standard error.
    logging.getLogger('trimesh').setLevel(logging.CRITICAL)
    try:
        # From memory, so that no other file that this one names is opened.
        with contextlib.redirect_stderr(io.StringIO()), np.errstate(all='ignore'):
            mesh = trimesh.load_mesh(io.BytesIO(path.read_bytes()), file_type=kind[1:],
                                     process=False, skip_materials=True)
            triangles = np.asarray(mesh.triangles, float) * _metres(mesh.units) * scale
    # Whatever a broken file does to a library that does not check it.
    except Exception as error:
        said = ' '.join(f'{type(error).__name__}: {error}'.split())
        raise errors.Unreadable('', said[:100], 'a mesh') from None
    # NaN is no less than anything.
    if not triangles.size or not np.abs(triangles).max() < FARTHEST:
        raise errors.Unreadable('', f'{len(triangles)} triangles',
                                f'some, all within {FARTHEST:g} m')
    return triangles


def _metres(units: str | None) -> float:
    """Metres to a unit as trimesh tells it of a DAE, '0.001 * meters'; others have none."""
    return float(units.split('*')[0]) if units and '*' in units else 1.0
