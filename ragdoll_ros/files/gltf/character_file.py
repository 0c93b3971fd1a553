"""The file of a fitted character: its nodes, bones and animations, and where its doll is in it."""
from __future__ import annotations

import functools
import os
from dataclasses import dataclass

import numpy as np

from ...model import errors, rotation
from ...model.pose import Pose
from ...model.ragdoll import Ragdoll, SkeletonFrame
from .bones import Bones, read_bones, unique_names
from .gltf_file import GltfFile
from .nodes import TO_ROS, Nodes, read_nodes
from .tracks import NodeAnimation, read_animations


@dataclass(frozen=True, eq=False)
class CharacterFile:
    """A character's file as it was when it was read; its buffers are read when they are needed."""

    path: str
    file: GltfFile
    nodes: Nodes
    bones: Bones

    @functools.cached_property
    def animations(self) -> dict[str, NodeAnimation]:
        """Animations by unique names. Raises a ModelError for a broken one."""
        found = read_animations(self.file)
        names = unique_names([each.entry.get('name') for each in found], 'animation')
        return dict(zip(names, found, strict=True))


def read_character_file(doll: Ragdoll) -> CharacterFile:
    """The file of the character that a doll was fitted to.

    Raises WrongForm for a doll without one, ModelErrors with the fault of the file.
    """
    if doll.model is None or not doll.riders:
        raise errors.WrongForm('model', doll.model, 'the .glb, .gltf or .vrm of a character that '
                               'ragdoll_fit made the doll of')
    with errors.naming(doll.model):
        stat = os.stat(doll.model)
        return _read(doll.model, (stat.st_mtime_ns, stat.st_size))


@functools.lru_cache(maxsize=4)
def _read(path: str, _: tuple[int, int]) -> CharacterFile:
    """Read a file, cached by its path, time of modification and size."""
    file = GltfFile(path)
    nodes = read_nodes(file)
    return CharacterFile(path, file, nodes, read_bones(file, nodes))


def file_to_doll(doll: Ragdoll, source: CharacterFile) -> np.ndarray:
    """Transform (4, 4) from the file's world to the doll's frame, found again from the riders.

    A fit changes axes, turns the front to +x by quarters of a turn, scales, and moves each of
    several characters to its own origin.
    """
    places = _places(doll, source.bones)
    edges, originals = _edges(places, source)
    scale, size = _scale(edges, originals), np.sum(edges ** 2) or 1.0

    def misfit(turn: np.ndarray) -> float:
        axes = [rotation.matrix(pose.orientation) - turn @ rotation.matrix(
            rotation.nearest_rotation(bind[:3, :3])) for pose, bind in places.values()]
        return float(np.sum((edges - scale * originals @ turn.T) ** 2) / size
                     + np.mean(np.square(axes)))

    quarters = (np.round(rotation.matrix(rotation.from_axis_angle((0, 0, 1), np.pi / 2 * k)))
                for k in range(4))
    turn = min((quarter @ TO_ROS for quarter in quarters), key=misfit)
    root = source.bones.names.index(rider_of(doll, doll.root.name).name)
    pose, bind = places[source.bones.nodes[root]]
    to_doll = np.eye(4)
    to_doll[:3, :3] = scale * turn
    to_doll[:3, 3] = pose.position - scale * turn @ bind[:3, 3]
    return to_doll


def _places(doll: Ragdoll, bones: Bones) -> dict[int, tuple[Pose, np.ndarray]]:
    """Return the pose in the doll's bind pose and the bind matrix of each rider, by its node.
    Raises UnknownBone.
    """
    index = {name: k for k, name in enumerate(bones.names)}
    found = {}
    for rider in doll.riders:
        if rider.name not in index:
            raise errors.UnknownBone('riders', rider.name,
                                     f'a doll that was fitted to {doll.model}')
        pose = doll.bone(rider.bone).pose.compose(rider_pose(rider))
        bone = index[rider.name]
        found[bones.nodes[bone]] = pose, bones.bind_matrices[bone]
    return found


def _edges(places: dict[int, tuple[Pose, np.ndarray]],
           source: CharacterFile) -> tuple[np.ndarray, np.ndarray]:
    """Return the vectors (e, 3) from the nearest rider above to each rider: in the doll, in the
    file. If no rider has one above, they begin at the origin.
    """
    ours, theirs = [], []
    for node, (pose, bind) in places.items():
        up = source.nodes.nearest(source.nodes.parents[node], places)
        if up >= 0:
            ours.append(pose.position - places[up][0].position)
            theirs.append(bind[:3, 3] - places[up][1][:3, 3])
    if not ours:
        # Of bones without parents from the origin, which is the same in both.
        ours = [pose.position for pose, _ in places.values()]
        theirs = [bind[:3, 3] for _, bind in places.values()]
    return np.array(ours), np.array(theirs)


def _scale(edges: np.ndarray, originals: np.ndarray) -> float:
    """Metres per unit of the file: the median ratio of the lengths of edges (e, 3)."""
    ours, theirs = (np.linalg.norm(each, axis=1) for each in (edges, originals))
    some = theirs > 1e-3 * theirs.max(initial=0.0)
    return float(np.median(ours[some] / theirs[some])) if some.any() else 1.0


def rider_of(doll: Ragdoll, body: str) -> SkeletonFrame:
    """The rider that carries a body: the one of its name, else its first. Raises UnknownBone."""
    own = [rider for rider in doll.riders if rider.bone == body]
    if not own:
        raise errors.UnknownBone('riders', body, 'a rider on this bone')
    return next((rider for rider in own if rider.name == body), own[0])


def bind_pose(to_doll: np.ndarray, bind: np.ndarray) -> Pose | None:
    """Pose of a bone in the character's bind pose, doll's frame, from its bind matrix (4, 4).

    None for a mirrored bone, whose axes are not unique.
    """
    if not np.linalg.det(bind[:3, :3]) > 0:
        return None
    turn = to_doll[:3, :3] / np.cbrt(np.linalg.det(to_doll[:3, :3]))
    return Pose(to_doll[:3] @ bind[:, 3], rotation.nearest_rotation(turn @ bind[:3, :3]))


def rider_pose(rider: SkeletonFrame) -> Pose:
    """Pose of a rider in its bone."""
    return Pose(np.array(rider.position), np.array(rider.orientation))
