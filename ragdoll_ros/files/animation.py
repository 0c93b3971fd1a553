"""Animations of a fitted character's file as motions of its doll.

A body of the doll moves as its bone of the character does: by N inv(B), with the global transform N
of the bone's node and its bind matrix B, which also moves the skin. Of a scale or shear only the
nearest rotation is taken.
"""
from __future__ import annotations

import dataclasses
import functools
import math
import os
from dataclasses import dataclass

import numpy as np

from ..model import errors, rotation
from ..model.dof_layout import DofLayout, GeneralizedState
from ..model.forward_kinematics import BoneMotion
from ..model.inverse_kinematics import FollowedMotion, follow_motions, follow_turns
from ..model.motion_spline import MotionSpline
from ..model.playback import Playback
from ..model.pose import Pose
from ..model.ragdoll import Ragdoll, SkeletonFrame
from ..model.scene import Placement
from .gltf.bones import Bones, read_bones, unique_names
from .gltf.gltf_file import GltfFile
from .gltf.nodes import TO_ROS, Nodes, read_nodes
from .gltf.tracks import KEY_TOLERANCE, NodeAnimation, read_animations

SMALLEST = 1e-30
"""Determinant of a bind pose, as of inverse bind matrices."""

LARGEST = 1e9
"""Of a transform in m, and of its rate, above which an animation is broken."""


SAMPLE_RATE, MOST_SAMPLES = 60.0, 100_000
"""Samples of a motion per s at least, and in all: 20 min. Of a swing by 0.5 rad at 1.2 Hz, splines
through 60 samples per s miss the velocity by less than 1e-4 rad/s."""


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


@dataclass(frozen=True, repr=False)
class Animation:
    """An animation of the file of a doll's character; ``name`` is as there, and unique."""

    name: str
    doll: Ragdoll
    _source: _File
    _to_doll: np.ndarray
    _carriers: tuple[Carrier, ...]

    def __repr__(self) -> str:
        return f'Animation {self.name!r} of {self.doll.name!r}: {self.duration:g} s'

    @property
    def duration(self) -> float:
        """s, from its beginning at 0. Raises a ModelError for a broken track."""
        return self._source.animations[self.name].duration

    def at(self, time: float) -> FollowedMotion:
        """The doll's motion at ``time`` s from the beginning, in the doll's frame of the bind pose.

        Its velocities are derivatives of the file's interpolation; at a key the mean of both
        sides. Raises OutOfRange for a time that is not within the animation, another ModelError
        for a broken track.
        """
        errors.check_range('time', time, 0.0, self.duration)
        return follow_motions(self.doll, self._bone_motions(np.array(time)))

    @functools.cached_property
    def motion(self) -> MotionSpline:
        """The doll's motion in the doll's frame: splines through samples at the keys of the file
        and at least SAMPLE_RATE times a second. Raises a ModelError for a broken track.
        """
        tracks = self._source.animations[self.name].tracks.values()
        keys = np.unique(np.concatenate([[0.0, self.duration], *(each.times for each in tracks)]))
        keys = keys[np.append(np.diff(keys) > KEY_TOLERANCE, True)]
        counts = np.ceil(np.diff(keys) * SAMPLE_RATE - 1e-3).astype(int).clip(1)
        if counts.sum() >= MOST_SAMPLES:
            raise errors.OutOfRange(f'{self.name}.duration', self.duration,
                                    f'an animation of at most {MOST_SAMPLES} samples')
        times = np.concatenate([keys[:1], *(
            np.linspace(begin, end, count + 1)[1:]
            for begin, end, count in zip(keys[:-1], keys[1:], counts, strict=True))])
        motions = self._bone_motions(times)
        return MotionSpline.sampled(*_coordinates(self.doll, times, motions))

    def _bone_motions(self, times: np.ndarray) -> dict[str, BoneMotion]:
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

    def place(self, placement: Placement, time: float) -> Placement:
        """The doll of ``placement`` as the animation has it at ``time`` s, with its velocities.

        Position and orientation of the placement are those of the animation's frame; its velocity
        is added. Raises OutOfRange for the time, WrongForm for a placement of another doll or with
        a spin, angles or rates.
        """
        return placed(placement, self.at(time))

    def play(self, placement: Placement, start: float = 0.0, speed: float = 1.0,
             loop: bool = False, limp_at: float = math.inf,
             limp_above: float = math.inf) -> Placement:
        """The doll of ``placement``, which the animation moves until it goes limp: see Playback.

        Position, orientation and velocity of the placement are those of the animation's frame.
        Raises OutOfRange or NotPositive for a number, WrongForm for a placement of another doll or
        with a spin, angles or rates.
        """
        return dataclasses.replace(placement, animation=Playback(
            self.name, self.motion, start, speed, loop, limp_at, limp_above))


def _coordinates(doll: Ragdoll, times: np.ndarray, motions: dict[str, BoneMotion]
                 ) -> tuple[DofLayout, np.ndarray, list[GeneralizedState]]:
    """Layout, ``times`` (k,), and coordinates of the doll as it follows ``motions``, stacked."""
    layout, root, found = DofLayout([doll]), motions[doll.root.name], follow_turns(doll, motions)
    names = [name for joint in doll.joints for name in joint.angle_names]
    zero = np.zeros(len(times))
    angles, rates = (np.array([found[name][key] if name in found else zero for name in names]
                              ).reshape(len(names), len(times)) for key in (0, 1))
    orientations = rotation.multiply(root.turn, np.array(doll.root.orientation))
    samples = []
    for k in range(len(times)):
        q, v = np.zeros(layout.sizes[0]), np.zeros(layout.sizes[1])
        q[layout.root_positions[0]] = root.position[k]
        q[layout.root_orientations[0]] = orientations[k]
        v[layout.root_velocities[0]] = root.velocity[k]
        v[layout.root_angular_velocities[0]] = root.spin[k]
        state = GeneralizedState(layout.with_joint_angles(q, angles[:, k]), v)
        samples.append(GeneralizedState(state.q, layout.with_joint_rates(state, rates[:, k])))
    return layout, times, samples


def placed(placement: Placement, motion: FollowedMotion) -> Placement:
    """A placement with the pose and velocities of ``motion``; see Animation.place()."""
    for key in ('spin', 'angles', 'rates'):
        value = getattr(placement, key)
        if any(value):
            raise errors.WrongForm(key, value, 'none: the animation has its own')
    if unknown := motion.distances.keys() - {bone.name for bone in placement.doll.bones}:
        raise errors.WrongForm('doll', placement.doll.name, f'a doll with the bone {min(unknown)}')
    frame = Pose(np.array(placement.position), np.array(placement.orientation))
    pose = frame.compose(motion.pose)
    velocity = np.array(placement.velocity) + rotation.rotate(frame.orientation, motion.velocity)
    return dataclasses.replace(
        placement, position=tuple(pose.position.tolist()),
        orientation=tuple(pose.orientation.tolist()), velocity=tuple(velocity.tolist()),
        spin=tuple(rotation.rotate(frame.orientation, motion.spin).tolist()),
        angles=motion.angles, rates=motion.rates)


def load_animations(doll: Ragdoll) -> dict[str, Animation]:
    """Read the animations of the file of a doll's character.

    Args:
        doll: as ragdoll_fit makes it of a .glb, .gltf or .vrm: it has a ``model`` and riders.

    Returns:
        Animations by their names, in the order of the file.

    Raises:
        WrongForm: for a doll without a character, or a bone whose bind pose has no size.
        UnknownBone: if the file has not the bones of the doll's riders.
        ModelErrors: if the file cannot be read.

    Example:
        >>> load_animations(load_doll('character'))
        {}
    """
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
    return {name: Animation(name, doll, source, to_doll, carriers) for name in source.animations}


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
