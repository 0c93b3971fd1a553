"""Mesh files of robots (STL, OBJ, DAE, glTF): found, and read by trimesh from the extra `fit`.

URDF and SDF name them by package://, model://, file:// or a relative path. Packages are searched in
ROS_PACKAGE_PATH and AMENT_PREFIX_PATH as in ROS, and in the folders above the URDF, because robots
are also distributed without ROS.
"""
import contextlib
import io
import logging
import math
import os
import urllib.parse
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ...model import errors, rotation
from ...model.mesh import THINNEST, Hull, Mesh
from ...model.pose import Pose
from ...model.shapes import Box
from ...model.vectors import vector

GLTF_SUFFIXES = ('.glb', '.gltf')

SUFFIXES = ('.stl', '.obj', '.dae', *GLTF_SUFFIXES)

UNSCALED = (1.0, 1.0, 1.0)

GLTF_TO_ROS = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""Rotation of glTF's axes, y up, to z up: a right angle about x, as RViz, Drake and Blender have it
(https://github.com/ros2/rviz/pull/1482)."""

MAX_MESH_BYTES = 64_000_000
"""The largest part of a scanned robot has 20 MB."""

MAX_COORDINATE = 1e5
"""m; a vertex farther from the origin shows a broken file."""

FLAT = 1e-6
"""Thickness over size up to which points have no hull."""

MIN_THICKNESS = 0.001
"""m; shortest edge of a box around a mesh."""

PACKAGE_SCHEMES = ('package', 'model')
"""Schemes that begin with the name of a package."""


def find_file(name: str, folder: Path | None) -> Path | None:
    """Find the file that ``name`` refers to in a file in ``folder`` (None: unknown). Returns None
    if it does not exist.
    """
    scheme, found, rest = name.partition('://')
    if not found:
        scheme, rest = 'file', name
    rest = urllib.parse.unquote(rest) if found else rest
    if scheme in PACKAGE_SCHEMES:
        tried = _in_packages(*rest.split('/', 1), folder) if '/' in rest else ()
    elif scheme == 'file':
        rest = rest.replace('\\', '/')
        tried = [above / rest for above in _ancestors(folder) or [Path('/')]]
    else:
        tried = ()
    return next((path for path in tried if _is_file(path)), None)


def _in_packages(package: str, rest: str, folder: Path | None) -> Iterator[Path]:
    for path in _environment_paths('ROS_PACKAGE_PATH'):
        yield path / package / rest
        if path.name == package:
            yield path / rest
    for prefix in _environment_paths('AMENT_PREFIX_PATH'):
        yield prefix / 'share' / package / rest
    for above in _ancestors(folder):
        yield above / package / rest
        # The package's own folder may have another name here.
        yield above / rest


def _environment_paths(variable: str) -> list[Path]:
    return [Path(path) for path in os.environ.get(variable, '').split(os.pathsep) if path]


def _ancestors(folder: Path | None) -> list[Path]:
    """A folder and its ancestors, nearest first."""
    return [] if folder is None else [folder.absolute(), *folder.absolute().parents]


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):
        # A name that is too long or contains a NUL.
        return False


def read_mesh(path: Path, scale: tuple[float, ...] = UNSCALED) -> np.ndarray:
    """Triangles (t, 3, 3) m of a mesh file, scaled along each axis.

    Raises Unreadable with the reason.
    """
    kind = path.suffix.lower()
    if kind not in SUFFIXES:
        raise errors.Unreadable('', path.name, 'one of ' + ', '.join(SUFFIXES))
    size = path.stat().st_size
    if size > MAX_MESH_BYTES:
        raise errors.Unreadable('', f'{size} bytes', f'at most {MAX_MESH_BYTES}')
    try:
        import trimesh
    except ImportError:
        raise errors.Unreadable('', path.name, "trimesh to read it: pip install '.[fit]'") from None
    # trimesh logs what it skips to standard error.
    logging.getLogger('trimesh').setLevel(logging.CRITICAL)
    try:
        # From memory, so that trimesh opens no file that this one names.
        with contextlib.redirect_stderr(io.StringIO()), np.errstate(all='ignore'):
            mesh = trimesh.load_mesh(io.BytesIO(path.read_bytes()), file_type=kind[1:],
                                     process=False, skip_materials=True)
            triangles = np.asarray(mesh.triangles, float) * _metres_per_unit(mesh.units)
            if kind in GLTF_SUFFIXES:
                triangles = triangles @ GLTF_TO_ROS.T
            triangles = triangles * scale
    # trimesh does not validate its input: a broken file may raise anything.
    except Exception as error:
        said = ' '.join(f'{type(error).__name__}: {error}'.split())
        raise errors.Unreadable('', said[:100], 'a mesh') from None
    # The comparison is false for NaN too.
    if not triangles.size or not np.abs(triangles).max() < MAX_COORDINATE:
        raise errors.Unreadable('', f'{len(triangles)} triangles',
                                f'some, all within {MAX_COORDINATE:g} m')
    return triangles


def read_surface(path: Path, scale: tuple[float, ...] = UNSCALED) -> Mesh:
    """The triangles of a mesh file as a surface. Raises a ModelError."""
    corners = read_mesh(path, scale)
    vertices, faces = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    faces = faces.reshape(-1, 3)
    if np.prod(scale) < 0:
        faces = faces[:, ::-1]  # a mirrored mesh is inside out
    return Mesh(vertices, faces, source=(str(path), vector(scale)))


def read_hull(path: Path, scale: tuple[float, ...] = UNSCALED) -> Hull:
    """The convex hull of a mesh file. Raises a ModelError."""
    return convex_hull(read_mesh(path, scale).reshape(-1, 3), source=(str(path), vector(scale)))


def convex_hull(points: np.ndarray, source: tuple | None = None) -> Hull:
    """The convex hull of points (p, 3) m, by Qhull. Raises Unreadable for what has no volume."""
    while True:
        spread = np.linalg.eigvalsh(np.cov(points.T))
        if not spread[0] > FLAT ** 2 * spread[2]:
            raise errors.Unreadable('', f'{len(points)} points', 'points around a volume')
        vertices, faces = _qhull(points)
        needless = _nearly_on_edges(vertices, faces)
        if not len(needless):
            return Hull(vertices, faces, source)
        points = np.delete(vertices, needless, axis=0)


def _qhull(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (v, 3) m and triangles (t, 3) of the convex hull of points (p, 3) m."""
    try:
        from trimesh.convex import convex_hull as hull_of
        found = hull_of(points)
    except ImportError:
        raise errors.Unreadable('', f'{len(points)} points',
                                "trimesh and scipy for a hull: pip install '.[fit]'") from None
    return np.asarray(found.vertices, float), np.asarray(found.faces)


def _nearly_on_edges(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return the indices of vertices that are nearly on the longest edge of their triangle, which
    therefore has no normal. Qhull makes such triangles of points that rounding has moved off a
    line.
    """
    corners = vertices[faces]
    lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    twice_area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0],
                                         corners[:, 2] - corners[:, 0]), axis=1)
    thin = twice_area <= 2 * THINNEST * lengths.max(axis=1) ** 2
    # The edge from corner k to k + 1 is opposite to k + 2.
    return np.unique(faces[thin, (lengths[thin].argmax(axis=1) + 2) % 3])


def enclosed_volume(mesh: Mesh) -> float:
    """Return the volume, m^3, inside a mesh that is one closed surface; NaN for others: of several
    surfaces, signed volumes count twice where they overlap. Needs trimesh and scipy.
    """
    import trimesh

    with np.errstate(all='ignore'):
        solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
        return float(solid.volume) if solid.is_volume and solid.body_count == 1 else math.nan


def shells_of(mesh: Mesh) -> np.ndarray:
    """Return the index (t,) of the surface of each face. Two faces are of one surface if they alone
    share an edge; so surfaces that touch at vertices or edges stay apart. Needs trimesh and scipy.
    """
    import trimesh

    edges = np.sort(mesh.faces[:, (0, 1, 1, 2, 2, 0)].reshape(-1, 2), axis=1)
    _, edge, count = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    edge = edge.ravel()
    order = np.argsort(edge, kind='stable')
    pairs = (order[count[edge[order]] == 2] // 3).reshape(-1, 2)
    return trimesh.graph.connected_component_labels(pairs, node_count=len(mesh.faces))


def bounding_box(triangles: np.ndarray) -> tuple[Box, Pose]:
    """The smaller of two boxes around triangles (t, 3, 3) m, along the mesh's own axes and along
    the principal axes of its vertices, and its pose in the mesh's frame.
    """
    points = np.unique(triangles.reshape(-1, 3), axis=0)
    _, principal = np.linalg.eigh(np.cov(points.T))
    principal = principal * (1, 1, np.linalg.det(principal))
    boxes = []
    for axes in (np.eye(3), principal):
        low, high = (points @ axes).min(axis=0), (points @ axes).max(axis=0)
        # A flat mesh has no thickness.
        size = np.maximum(high - low, MIN_THICKNESS)
        boxes.append((size.prod(), size, axes @ (low + high) / 2, axes))
    _, size, centre, axes = min(boxes, key=lambda box: box[0])
    return Box(vector(size)), Pose(centre, rotation.from_matrix(axes))


def _metres_per_unit(units: str | None) -> float:
    """Metres per unit from trimesh's units of a DAE, '0.001 * meters'; else 1."""
    return float(units.split('*')[0]) if units and '*' in units else 1.0
