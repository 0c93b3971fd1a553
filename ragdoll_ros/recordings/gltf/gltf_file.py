"""Recordings as glTF 2.0 animations.

Y up, facing +Z, metres. Each doll is a node. That of a fitted character contains the character's
file (character.py). Of others each bone is a child node with a mesh at the bone's centre of mass,
in its axes; the animation has poses, not joint angles, so that errors do not add up along a limb.
"""
import math
import warnings
from collections.abc import Callable

import numpy as np

from ...model import errors
from ...model.compound import Compound
from ...model.pose import Pose
from ...model.ragdoll import DEFAULT_COLOR, Bone, Ragdoll
from ...model.shapes import Shape
from ..file_skeleton import carrier_poses, find_file_skeleton, not_of_its_file
from ..recording import Recording, orientations_y_up, points_y_up
from .animation import GltfAnimation, continuous
from .character import add_character
from .copied_file import CopiedFile
from .glb import ATTRIBUTES, Glb
from .gltf_skin import add_material

CREASE = math.radians(40)
"""rad, crease angle: above the 18 degrees between faces of a circle of 20 vertices, below a box's
90."""


def gltf_bytes(recording: Recording, warn: Callable[[str], None] = warnings.warn) -> bytes:
    """Return a recording as a .glb file.

    Numbers are float32, so each doll's node is at the middle of its motion, rounded to metres:
    within 16 m positions are exact to 1e-6 m. Of swings, only what hangs on their links in a
    character's file is written. ``warn`` receives a sentence for each doll whose character's file
    can not be read; instead of the character, the shapes of its bones are written.
    """
    glb = Glb()
    animation = GltfAnimation(glb, recording.times)
    shapes = _Shapes(glb)
    files: dict[str, CopiedFile] = {}
    roots = []
    carriers = carrier_poses(recording.scene, Pose(recording.positions, recording.orientations),
                             recording.rods)
    for placement, bones in zip(recording.scene.dolls, carriers, strict=True):
        skeleton = find_file_skeleton(placement, warn)
        if skeleton is not None:
            path = skeleton.source.path
            try:
                if path not in files:
                    files[path] = CopiedFile(glb, skeleton.source.file)
                roots.append(add_character(animation, files[path], skeleton, bones,
                                           placement.name))
                continue
            except (errors.ModelError, OSError) as error:
                warn(not_of_its_file(placement, error))
        roots.append(_add_shapes(animation, shapes, placement.doll, bones, placement.name))
    animation.end(recording.scene.name)
    glb.document['scene'] = glb.add('scenes', name=recording.scene.name, nodes=roots)
    return glb.content()


def _add_shapes(animation: GltfAnimation, shapes: '_Shapes', doll: Ragdoll, bones: Pose,
                name: str) -> int:
    """Add a doll's bones with their shapes and their motion (k, b or more). Returns the index of
    the doll's node.
    """
    bones = bones.at(np.arange(len(doll.bones)))
    positions, orientations = points_y_up(bones.position), continuous(
        orientations_y_up(bones.orientation))
    origin = np.round((positions.max(axis=(0, 1)) + positions.min(axis=(0, 1))) / 2)
    nodes = []
    for k, bone in enumerate(doll.bones):
        tracks = {'translation': (positions[:, k] - origin).astype(np.float32),
                  'rotation': orientations[:, k].astype(np.float32)}
        nodes.append(animation.glb.add('nodes', name=bone.name, mesh=shapes.mesh(bone), **{
            key: track[0].tolist() for key, track in tracks.items()}))
        animation.add(nodes[-1], tracks)
    return animation.glb.add('nodes', name=name, translation=origin.tolist(), children=nodes)


class _Shapes:
    """Meshes of bones; equal ones are shared."""

    def __init__(self, glb: Glb) -> None:
        self._glb = glb
        self._meshes: dict[tuple, int] = {}
        self._attributes: dict[Shape | Compound, dict[str, int]] = {}
        self._materials: dict[tuple[float, ...], int] = {}

    def mesh(self, bone: Bone) -> int:
        """Index of a bone's mesh, in its own axes and colour."""
        color = bone.color or DEFAULT_COLOR
        key = bone.shape, color
        if key not in self._meshes:
            if color not in self._materials:
                self._materials[color] = add_material(self._glb, color)
            primitive = {'attributes': self._surface(bone.shape),
                         'material': self._materials[color]}
            self._meshes[key] = self._glb.add('meshes', primitives=[primitive])
        return self._meshes[key]

    def _surface(self, shape: Shape | Compound) -> dict[str, int]:
        if shape not in self._attributes:
            places, normals = (points_y_up(each).astype(np.float32)
                               for each in crease_normals(*shape.mesh()))
            self._attributes[shape] = {'POSITION': self._glb.accessor(places, ATTRIBUTES),
                                       'NORMAL': self._glb.accessor(normals, ATTRIBUTES)}
        return self._attributes[shape]


def crease_normals(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices (3t, 3) m, three to each of ``triangles`` (t, 3), and their unit normals.

    A vertex of a face has as normal the mean, weighted by area, of the normals of those faces
    around it that are within CREASE of the face's own. Degenerate faces are left out.
    """
    corners = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    full = areas > 1e-9 * areas.max(initial=0.0)
    corners, triangles, normals = corners[full], triangles[full], normals[full]
    units = normals / areas[full, None]
    _, at = np.unique(vertices.round(12), axis=0, return_inverse=True)
    points = at.reshape(-1)[triangles]
    smooth = np.empty_like(corners)
    for point in np.unique(points):
        faces, slots = np.nonzero(points == point)
        near = units[faces] @ units[faces].T > math.cos(CREASE)
        sums = near @ normals[faces]
        smooth[faces, slots] = sums / np.linalg.norm(sums, axis=1, keepdims=True)
    return corners.reshape(-1, 3), smooth.reshape(-1, 3)
