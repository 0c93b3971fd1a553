"""Motions of a doll's bodies by the animations of its character's file.

A body of the doll moves as its bone of the character does: by N inv(B), with the global transform N
of the bone's node and its bind matrix B, which also moves the skin. Of a scale or shear only the
nearest rotation is taken.
"""
from __future__ import annotations

import functools
import os
from dataclasses import dataclass

import numpy as np

from ...model import errors, rotation
from ...model.forward_kinematics import BoneMotion
from ...model.pose import Pose
from ...model.ragdoll import Ragdoll, SkeletonFrame
from .bones import Bones, read_bones, unique_names
from .gltf_file import GltfFile
from .nodes import TO_ROS, Nodes, read_nodes
from .tracks import NodeAnimation, read_animations

SMALLEST = 1e-30
"""Determinant of a bind pose, as of inverse bind matrices."""

LARGEST = 1e9
"""Of a transform in m, and of its rate, above which an animation is broken."""


@dataclass(frozen=True)
class _File:
    """What the animations of a file need of it."""

    nodes: Nodes
    bones: Bones
    animations: dict[str, NodeAnimation]


@dataclass(frozen=True)
class Carrier:
    """The bone of a character that carries a body of its doll."""

    body: str
    node: int
    pose: Pose
    """Of the body in the character's bind pose, doll's frame."""
    from_bind: np.ndarray
    """(4, 4) from the doll's frame to the bone's in the bind pose."""


@dataclass(frozen=True, eq=False)
class CharacterMotion:
    """An animation of a character's file as BodyMotions of its doll."""

    name: str
    doll: Ragdoll
    _source: _File
    _to_doll: np.ndarray
    _carriers: tuple[Carrier, ...]

    @property
    def duration(self) -> float:
        """s, from its beginning at 0. Raises a ModelError for a broken track."""
        return self._source.animations[self.name].duration

    @property
    def key_times(self) -> np.ndarray:
        """(k,) s, of the keys of all tracks."""
        tracks = self._source.animations[self.name].tracks.values()
        return np.concatenate([each.times for each in tracks])

    def at(self, times: np.ndarray) -> dict[str, BoneMotion]:
        """Motions of the bodies as their bones move, at ``times`` (...), in the doll's frame."""
        # Overflow shows in the results, which are checked.
        with np.errstate(over='ignore', invalid='ignore'):
            both = np.array(self._source.animations[self.name].worlds(self._source.nodes, times))
            motions = {}
            for carrier in self._carriers:
                moved, rate = self._to_doll @ both[:, carrier.node] @ carrier.from_bind
                largest = max(np.abs(moved).max(), np.abs(rate).max())
                if not largest < LARGEST:
                    raise errors.OutOfRange(f'{self.name}.{carrier.body}', float(largest),
                                            f'transforms of at most {LARGEST:g}, m, and per s')
                place = np.append(carrier.pose.position, 1.0)
                orientation = rotation.multiply(rotation.nearest_rotation(moved[..., :3, :3]),
                                                carrier.pose.orientation)
                motions[carrier.body] = BoneMotion(
                    rotation.multiply(orientation, rotation.inverse(
                        self.doll.bone(carrier.body).orientation)),
                    moved[..., :3, :] @ place, rate[..., :3, :] @ place,
                    rotation.nearest_rotation_spin(moved[..., :3, :3], rate[..., :3, :3]))
        return motions


def read_character_motions(doll: Ragdoll) -> dict[str, CharacterMotion]:
    """The animations of the file of a doll's character, by their names; see load_animations()."""
    if doll.model is None or not doll.riders:
        raise errors.WrongForm('model', doll.model, 'the .glb, .gltf or .vrm of a character that '
                               'ragdoll_fit made the doll of')
    try:
        stat = os.stat(doll.model)
        source = _read(doll.model, (stat.st_mtime_ns, stat.st_size))
    except errors.ModelError as error:
        raise errors.ModelErrors(doll.model, [error]) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, 'strerror', None) or str(error)
        unreadable = errors.Unreadable('', reason, 'a file that can be read')
        raise errors.ModelErrors(doll.model, [unreadable]) from None
    if not source.animations:
        return {}
    to_doll = _file_to_doll(doll, source)
    carriers = _carriers(doll, source.bones, to_doll)
    return {name: CharacterMotion(name, doll, source, to_doll, carriers)
            for name in source.animations}


@functools.lru_cache(maxsize=4)
def _read(path: str, _: tuple[int, int]) -> _File:
    """Read a file, cached by its path, time of modification and size."""
    file = GltfFile(path)
    nodes = read_nodes(file)
    found = read_animations(file)
    names = unique_names([each.entry.get('name') for each in found], 'animation')
    return _File(nodes, read_bones(file, nodes), dict(zip(names, found, strict=True)))


def _file_to_doll(doll: Ragdoll, source: _File) -> np.ndarray:
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
    root = source.bones.names.index(_rider_of(doll, doll.root.name).name)
    pose, bind = places[source.bones.nodes[root]]
    to_doll = np.eye(4)
    to_doll[:3, :3] = scale * turn
    to_doll[:3, 3] = pose.position - scale * turn @ bind[:3, 3]
    return to_doll


def _places(doll: Ragdoll, bones: Bones) -> dict[int, tuple[Pose, np.ndarray]]:
    """Pose in the doll's bind pose, and bind matrix, of each rider, by its node."""
    index = {name: k for k, name in enumerate(bones.names)}
    found = {}
    for rider in doll.riders:
        if rider.name not in index:
            raise errors.UnknownBone('riders', rider.name,
                                     f'a doll that was fitted to {doll.model}')
        pose = doll.bone(rider.bone).pose.compose(_pose(rider))
        bone = index[rider.name]
        found[bones.nodes[bone]] = pose, bones.bind_matrices[bone]
    return found


def _edges(places: dict[int, tuple[Pose, np.ndarray]],
           source: _File) -> tuple[np.ndarray, np.ndarray]:
    """From the nearest rider above to each rider (e, 3): in the doll, in the file."""
    ours, theirs = [], []
    for node, (pose, bind) in places.items():
        up = source.nodes.parents[node]
        while up >= 0 and up not in places:
            up = source.nodes.parents[up]
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


def _rider_of(doll: Ragdoll, body: str) -> SkeletonFrame:
    """The rider that carries a body: the one of its name, else its first. Raises UnknownBone."""
    own = [rider for rider in doll.riders if rider.bone == body]
    if not own:
        raise errors.UnknownBone('riders', body, 'a rider on this bone')
    return next((rider for rider in own if rider.name == body), own[0])


def _carriers(doll: Ragdoll, bones: Bones, to_doll: np.ndarray) -> tuple[Carrier, ...]:
    """The carriers of all bodies that have riders."""
    index = {name: k for k, name in enumerate(bones.names)}
    turn = to_doll[:3, :3] / np.cbrt(np.linalg.det(to_doll[:3, :3]))
    found = []
    for body in sorted({rider.bone for rider in doll.riders}):
        rider = _rider_of(doll, body)
        bone = index[rider.name]
        bind = bones.bind_matrices[bone]
        if not abs(np.linalg.det(to_doll @ bind)) > SMALLEST:
            raise errors.WrongForm('riders', rider.name, 'a bone with a scale in its bind pose')
        pose = doll.bone(body).pose
        if np.linalg.det(bind[:3, :3]) > 0:
            # A limb of the doll may have been moved; of a mirrored bone the axes are not unique.
            there = Pose(to_doll[:3] @ bind[:, 3],
                         rotation.nearest_rotation(turn @ bind[:3, :3]))
            pose = there.compose(_pose(rider).relative(Pose()))
        found.append(Carrier(body, bones.nodes[bone], pose, np.linalg.inv(to_doll @ bind)))
    return tuple(found)


def _pose(rider: SkeletonFrame) -> Pose:
    return Pose(np.array(rider.position), np.array(rider.orientation))
