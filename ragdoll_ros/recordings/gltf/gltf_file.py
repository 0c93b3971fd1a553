"""Recordings as glTF 2.0 animations.

Y up, facing +Z, metres. Each doll is a node, each bone a child node with a mesh at the bone's
centre of mass, in its axes. The animation has poses, not joint angles, so that errors do not add up
along a limb.
"""
import math
from collections.abc import Mapping

import numpy as np

from ...model.compound import Compound
from ...model.link_frames import LinkFrames
from ...model.pose import Pose
from ...model.ragdoll import DEFAULT_COLOR, Bone
from ...model.shapes import Shape
from ...model.skeleton import Skin
from ...model.swing_mount import mount_swings
from ..recording import Recording, orientations_y_up, points_y_up
from .glb import ATTRIBUTES, Glb
from .gltf_skin import add_material, add_skin

CREASE = math.radians(40)
"""rad, crease angle: above the 18 degrees between faces of a circle of 20 vertices, below a box's
90."""


def gltf_bytes(recording: Recording, skins: Mapping[int, Skin] = {}) -> bytes:
    """A recording as a .glb file.

    ``skins`` of dolls, by index in the scene, replace the meshes of their bones. Numbers are
    float32, so each doll's node is at the middle of its motion, rounded to metres: within 16 m
    positions are exact to 1e-6 m. Of swings only the links that move a skin are written, as nodes.
    """
    glb = Glb()
    motion = _Motion(glb, recording.times)
    shapes = _Shapes(glb)
    links = _link_poses(recording, skins)
    roots = []
    for index, (placement, part) in enumerate(
            zip(recording.scene.dolls, recording.scene.bone_slices, strict=True)):
        positions = points_y_up(recording.positions[:, part])
        orientations = _continuous(orientations_y_up(recording.orientations[:, part]))
        origin = np.round((positions.max(axis=(0, 1)) + positions.min(axis=(0, 1))) / 2)
        nodes = []
        for k, bone in enumerate(placement.doll.bones):
            shown = {} if index in skins else {'mesh': shapes.mesh(bone)}
            nodes.append(motion.node(bone.name, positions[:, k] - origin, orientations[:, k],
                                     **shown))
        joints = [nodes[bone] for bone in skins[index].bones] if index in skins else []
        if index in links:
            for name, pose in links[index]:
                nodes.append(motion.node(name, pose.position - origin, pose.orientation))
                joints.append(nodes[-1])
        roots.append(glb.add('nodes', name=placement.name, translation=origin.tolist(),
                             children=nodes))
        if index in skins:
            roots.append(add_skin(glb, skins[index], joints, f'{placement.name} skin'))
    glb.add('animations', name=recording.scene.name, channels=motion.channels,
            samplers=motion.samplers)
    glb.document['scene'] = glb.add('scenes', name=recording.scene.name, nodes=roots)
    return glb.content()


def _link_poses(recording: Recording,
                skins: Mapping[int, Skin]) -> dict[int, list[tuple[str, Pose]]]:
    """Names and poses (k,), Y up, of the links that move the skin of each doll that has some."""
    scene = recording.scene
    if not any(len(skin.links) for skin in skins.values()):
        return {}
    poses = LinkFrames(scene).poses(Pose(recording.positions, recording.orientations),
                                    recording.rods)
    names = [name for mount in mount_swings(scene) for name in mount.names]
    found = {}
    for index, skin in skins.items():
        links = skin.links + scene.link_slices[index].start
        own = poses.at(links)
        points, turns = points_y_up(own.position), _continuous(orientations_y_up(own.orientation))
        found[index] = [(names[link], Pose(points[:, k], turns[:, k]))
                        for k, link in enumerate(links)]
    return found


class _Motion:
    """The animation's channels and samplers, and the nodes that it moves."""

    def __init__(self, glb: Glb, times: np.ndarray) -> None:
        self._glb = glb
        self._times = glb.accessor(times.astype(np.float32))
        self.channels: list[dict] = []
        self.samplers: list[dict] = []

    def node(self, name: str, positions: np.ndarray, orientations: np.ndarray,
             **entry: int) -> int:
        """Add a node with these poses (k, 3) m and (k, 4), Y up; its index."""
        tracks = {'translation': positions.astype(np.float32),
                  'rotation': orientations.astype(np.float32)}
        node = self._glb.add('nodes', name=name, **entry, **{
            key: track[0].tolist() for key, track in tracks.items()})
        for key, track in tracks.items():
            self.channels.append({'sampler': len(self.samplers),
                                  'target': {'node': node, 'path': key}})
            self.samplers.append({'input': self._times, 'output': self._glb.accessor(track)})
        return node


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


def _continuous(orientations: np.ndarray) -> np.ndarray:
    """The same rotations (k, n, 4), with the sign of q that is nearer to the instant before."""
    steps = np.einsum('kni,kni->kn', orientations[1:], orientations[:-1])
    signs = np.cumprod(np.where(steps < 0, -1.0, 1.0), axis=0)
    return np.concatenate([orientations[:1], orientations[1:] * signs[..., None]])


def crease_normals(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (3t, 3) m, three to each of ``triangles`` (t, 3), and their unit normals.

    A normal is the mean, weighted by area, of those of the faces around the vertex within CREASE of
    its own face's. Degenerate faces are left out.
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
