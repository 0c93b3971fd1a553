"""The hulls of a mesh file: one where it fits, else one of each of its closed surfaces where those
fit, else several by V-HACD from the extra `fit`.

Mamou, Volumetric Hierarchical Approximate Convex Decomposition, in Game Engine Gems 3, 2016: the
mesh is filled with voxels, which are split by planes until each piece is nearly convex, and merged
again where the pieces are too many. The vertices of their hulls are moved onto the mesh.
"""
import functools
from pathlib import Path

import numpy as np

from ...model import errors
from ...model.mesh import Hull, Mesh
from .mesh_file import UNSCALED, convex_hull, enclosed_volume, read_surface, shells_of

FITS = 1.05
"""Volume of one hull over that of the mesh up to which it stands for the mesh."""

MOST_HULLS, MOST_VERTICES = 16, 32
"""Hulls of a mesh, and vertices of each."""

RESOLUTION = 100_000
"""Voxels: 66 along the longest edge of the bounding box. With 400 000, 104, and 3 times as slow."""

TOUCHING = 1e-5
"""Of the size of the largest hull: what overlaps by less has met in rounding."""

SPLIT_ABOVE = 1.0
"""%: a hull that has so much more volume than its voxels is split."""


def read_hulls(path: Path, scale: tuple[float, ...] = UNSCALED) -> tuple[Hull, ...]:
    """Hulls that together are the solid of a mesh file, in its frame. Raises a ModelError.

    They are the same to the bit in each process. A mesh with holes that are larger than a voxel is
    hollow: its hulls are its walls.
    """
    mesh = read_surface(path, scale)
    whole = convex_hull(mesh.vertices)
    # The comparison is false for a mesh that is no closed surface.
    if whole.volume <= FITS * enclosed_volume(mesh):
        return (whole,)
    parts = _hulls_of_shells(mesh) or _decomposed(mesh)
    # Where they have nearly its volume, they fit no better.
    return parts if whole.volume > FITS * sum(part.volume for part in parts) > 0 else (whole,)


@functools.lru_cache(maxsize=64)
def _hulls_of_shells(mesh: Mesh) -> tuple[Hull, ...]:
    """Return the exact hull of each closed surface of a mesh of several. Empty if one hull does not
    fit, if there are more than MOST_HULLS, or if the bounding boxes of two show that they may
    overlap, as overlaps would count twice.
    """
    shells = shells_of(mesh)
    if not 1 < shells.max() + 1 <= MOST_HULLS:
        return ()
    hulls = []
    for shell in range(shells.max() + 1):
        used, faces = np.unique(mesh.faces[shells == shell], return_inverse=True)
        surface = Mesh(mesh.vertices[used], faces.reshape(-1, 3))
        hull = _hull(surface.vertices)
        if hull is None or not hull.volume <= FITS * enclosed_volume(surface):
            return ()
        hulls.append(hull)
    return () if _may_overlap(hulls) else tuple(hulls)


def _may_overlap(hulls: list[Hull]) -> bool:
    """Whether the bounding boxes of two hulls overlap along all axes by more than TOUCHING times
    the largest extent.
    """
    lower, upper = (np.array([hull.bounds[side] for hull in hulls]) for side in range(2))
    common = np.minimum(upper[:, None], upper) - np.maximum(lower[:, None], lower)
    allowed = TOUCHING * (upper - lower).max()
    return bool((common > allowed).all(axis=2)[np.triu_indices(len(hulls), 1)].any())


@functools.lru_cache(maxsize=64)
def _decomposed(mesh: Mesh) -> tuple[Hull, ...]:
    """Hulls of a convex decomposition; kept, as robots have several links of one mesh."""
    hulls = [_hull(points) for points in _pieces(mesh)]
    if None in hulls:
        # The voxels of a sheet have no volume once they are moved onto it.
        hulls = [hull or _hull(points) for hull, points in zip(
            hulls, _pieces(mesh, onto_mesh=False), strict=True)]
    return tuple(dict.fromkeys(hull for hull in hulls if hull))


def _pieces(mesh: Mesh, onto_mesh: bool = True) -> list[np.ndarray]:
    """Points (p, 3) m of each piece by V-HACD."""
    try:
        from vhacdx import compute_vhacd
    except ImportError:
        raise errors.Unreadable('', 'a mesh that one hull fits badly',
                                "vhacdx to split it: pip install '.[fit]'; or its hull") from None
    faces = np.insert(mesh.faces, 0, 3, axis=1).astype(np.uint32).ravel()
    # The best planes go through edges of the mesh. Threads would finish in any order.
    pieces = compute_vhacd(mesh.vertices, faces, MOST_HULLS, RESOLUTION, SPLIT_ABOVE,
                           maxNumVerticesPerCH=MOST_VERTICES, shrinkWrap=onto_mesh,
                           findBestPlane=True, asyncACD=False)
    return [points for points, _ in pieces]


def _hull(points: np.ndarray) -> Hull | None:
    """The hull of a piece; None if it has no volume."""
    try:
        return convex_hull(points)
    except errors.ModelError:
        return None
