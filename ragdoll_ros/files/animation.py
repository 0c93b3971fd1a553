"""Animations of dolls: of their characters' glTF files, and of BVH files of motion capture."""
from __future__ import annotations

import dataclasses
import functools
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import numpy as np

from ..model import errors, rotation
from ..model.dof_layout import DofLayout, GeneralizedState
from ..model.forward_kinematics import BoneMotion
from ..model.inverse_kinematics import FollowedMotion, follow_motions, follow_turns
from ..model.motion_spline import MotionSpline
from ..model.playback import Playback
from ..model.ragdoll import Ragdoll
from ..model.scene import Placement
from .bvh.doll_motion import read_bvh_motion
from .gltf.character_motion import read_character_motions
from .key_track import KEY_TOLERANCE

SAMPLE_RATE, MOST_SAMPLES = 60.0, 100_000
"""Samples of a motion per s at least, and in all: 20 min. Of a swing by 0.5 rad at 1.2 Hz, splines
through 60 samples per s miss the velocity by less than 1e-4 rad/s."""


class BodyMotions(Protocol):
    """Protocol of the motions of a doll's bodies over time, read from a file, in the
    doll's frame.
    """

    @property
    def duration(self) -> float:
        """Duration, s, from 0 to the last key. Raises a ModelError for a broken track."""

    @property
    def key_times(self) -> np.ndarray:
        """Times (k,) of the file's keys, s."""

    def at(self, times: np.ndarray) -> dict[str, BoneMotion]:
        """Motions of the bodies by their names, at ``times`` (...) s."""


@dataclass(frozen=True, repr=False)
class Animation:
    """An animation of a doll: from the file of its character, where ``name`` is unique, or from a
    .bvh ``file``. ``bones`` has the names of that file's joints that were chosen, by body.
    """

    name: str
    doll: Ragdoll
    _source: BodyMotions
    file: str | None = None
    bones: Mapping[str, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        return f'Animation {self.name!r} of {self.doll.name!r}: {self.duration:g} s'

    @property
    def duration(self) -> float:
        """Duration, s, from 0 to the last key. Raises a ModelError for a broken track."""
        return self._source.duration

    def at(self, time: float) -> FollowedMotion:
        """Return the doll's motion at ``time`` s from the beginning, in the animation's frame: the
        doll's frame in the bind pose.

        Velocities are derivatives of the interpolated keys, see KeyTrack; at a key, the mean of
        both sides. Raises OutOfRange for a time that is not within the animation, another
        ModelError for a broken track.
        """
        errors.check_range('time', time, 0.0, self.duration)
        return follow_motions(self.doll, self._source.at(np.array(time)))

    @functools.cached_property
    def motion(self) -> MotionSpline:
        """The doll's motion in the doll's frame: splines through samples at the keys of the file
        and at least SAMPLE_RATE times a second. Raises a ModelError for a broken track, or for more
        than MOST_SAMPLES samples.
        """
        keys = np.unique(np.append([0.0, self.duration], self._source.key_times))
        keys = keys[np.append(np.diff(keys) > KEY_TOLERANCE, True)]
        counts = np.ceil(np.diff(keys) * SAMPLE_RATE - 1e-3).astype(int).clip(1)
        if counts.sum() >= MOST_SAMPLES:
            raise errors.OutOfRange(f'{self.name}.duration', self.duration,
                                    f'an animation of at most {MOST_SAMPLES} samples')
        times = np.concatenate([keys[:1], *(
            np.linspace(begin, end, count + 1)[1:]
            for begin, end, count in zip(keys[:-1], keys[1:], counts, strict=True))])
        motions = self._source.at(times)
        return MotionSpline.sampled(*_coordinates(self.doll, times, motions))

    def place(self, placement: Placement, time: float) -> Placement:
        """Return ``placement`` with the pose and velocities that the animation has at ``time`` s.

        Position and orientation of the placement are those of the animation's frame; its velocity
        is added. Raises OutOfRange for the time, WrongForm for a placement whose doll lacks a body
        of the animation, or with a spin, angles or rates.
        """
        return placed(placement, self.at(time))

    def play(self, placement: Placement, start: float = 0.0, speed: float = 1.0,
             loop: bool = False, limp_at: float = math.inf,
             limp_above: float = math.inf) -> Placement:
        """Return ``placement`` with its doll moved by the animation until the doll goes limp: see
        Playback.

        Position, orientation and velocity of the placement are those of the animation's frame.
        Raises OutOfRange, NotPositive or NotFinite for a number, WrongForm for a placement of
        another doll or with a spin, angles or rates.
        """
        return dataclasses.replace(placement, animation=Playback(
            self.name, self.motion, start, speed, loop, limp_at, limp_above, self.file, self.bones))


def _coordinates(doll: Ragdoll, times: np.ndarray, motions: dict[str, BoneMotion]
                 ) -> tuple[DofLayout, np.ndarray, list[GeneralizedState]]:
    """Return the doll's layout, ``times`` (k,), and the doll's coordinates and velocities at each
    of them, as it follows ``motions``, stacked over the times.
    """
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
    frame = placement.pose
    pose = frame.compose(motion.pose)
    velocity = np.array(placement.velocity) + rotation.rotate(frame.orientation, motion.velocity)
    return dataclasses.replace(
        placement, position=tuple(pose.position.tolist()),
        orientation=tuple(pose.orientation.tolist()), velocity=tuple(velocity.tolist()),
        spin=tuple(rotation.rotate(frame.orientation, motion.spin).tolist()),
        angles=motion.angles, rates=motion.rates)


def load_animations(doll: Ragdoll, file: str | Path | None = None,
                    bones: Mapping[str, str] | None = None) -> dict[str, Animation]:
    """Read the animations of the file of a doll's character, or of a motion capture file.

    Args:
        doll: without ``file``, a doll that ragdoll_fit made of a .glb, .gltf or .vrm: it has a
            ``model`` and riders. With ``file``, any doll.
        file: a .bvh, whose joints have the names of the doll's bodies or riders, or common names of
            a person's.
        bones: names of joints of the file, by body, for bodies whose joint is chosen here instead
            of found by name.

    Returns:
        Animations by their names, in the order of the file; of a .bvh, one that has the name
        of the file without its suffix.

    Raises:
        WrongForm: for a doll without a character, a bone whose bind pose has no size, or a .bvh
            none of whose joints belongs to a body.
        UnknownBone: for a wrong body in ``bones``, or a rider that the file does not have.
        UnknownJoint: for a joint in ``bones`` that the file lacks.
        ModelErrors: if the file cannot be read.

    Example:
        >>> load_animations(load_doll('character'))
        {}
    """
    if file is None:
        return {name: Animation(name, doll, motion)
                for name, motion in read_character_motions(doll).items()}
    name, chosen = Path(file).stem, dict(bones or {})
    return {name: Animation(name, doll, read_bvh_motion(doll, file, chosen),
                            os.path.abspath(file), chosen)}
