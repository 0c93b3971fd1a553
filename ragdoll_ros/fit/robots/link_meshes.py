"""Shapes of a robot's links that are described by meshes."""
from __future__ import annotations

from pathlib import Path

from ...files.urdf_tree import UrdfLink, UrdfMesh
from ...model import errors
from ...model.pose import Pose
from ...model.shapes import Shape
from .mesh_file import read_mesh
from .mesh_path import find_mesh
from .mesh_shapes import fit_mesh

Placed = tuple[Shape, Pose]
"""A shape and where it stands."""


class LinkMeshes:
    """Meshes of a URDF in ``folder`` (None: not known) as shapes; each file is fitted once."""

    def __init__(self, folder: Path | None) -> None:
        self._folder = folder
        self._fitted: dict[tuple, list[Placed]] = {}

    def shapes(self, link: UrdfLink, notes: list[str]) -> list[Placed]:
        """Shapes in the link's frame; a note says which mesh could not be read."""
        found = []
        for mesh in link.meshes:
            try:
                found += [(shape, mesh.pose.compose(pose)) for shape, pose in self._fit(mesh)]
            except errors.Unreadable as error:
                notes.append(f'{link.name}: the mesh {mesh.file} is left out: {error.value}; '
                             f'expected {error.expected}')
        return found

    def _fit(self, mesh: UrdfMesh) -> list[Placed]:
        path = find_mesh(mesh.file, self._folder)
        if path is None:
            raise errors.Unreadable('', 'no such file', 'one beside the URDF or in a ROS package')
        key = path, mesh.scale
        if key not in self._fitted:
            self._fitted[key] = fit_mesh(read_mesh(path, mesh.scale))
        return self._fitted[key]
