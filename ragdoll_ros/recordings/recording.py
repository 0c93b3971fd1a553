"""Recordings: poses of a scene over time, with interpolation, rods of swings, and conversion to Y
up.

glTF (2.0, 3.4) and BVH have Y up, facing +Z, left at +X: (x, y, z) there is (y, z, x) here, a
rotation, so that quaternions' vector parts change likewise.
"""
from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..model import errors, rotation
from ..model.scene import SECOND, Scene
from ..model.state import State
from ..model.swing_mount import mount_swings

if TYPE_CHECKING:
    from ..physics.simulation import Simulation

UNIT_TOLERANCE = 1e-6
"""Largest deviation of a quaternion's norm from 1."""


@dataclass(frozen=True)
class RecordedPose:
    """One instant: positions (n, 3) m, orientations (n, 4) x, y, z, w, rods (m, 2, 3) m."""

    positions: np.ndarray
    orientations: np.ndarray
    rods: np.ndarray | None = None


@dataclass(frozen=True)
class Recording:
    """World poses of a scene's n bones at k >= 1 instants. Raises a ModelError for wrong arrays."""

    scene: Scene
    times: np.ndarray
    """(k,) s, ascending from 0."""
    positions: np.ndarray
    """(k, n, 3) m, world frame."""
    orientations: np.ndarray
    """(k, n, 4) unit quaternions x, y, z, w."""
    rods: np.ndarray | None = None
    """(k, m, 2, 3) m: both ends of each rod of the swings."""

    def __post_init__(self) -> None:
        count, bones = len(self.times), len(self.scene.bones)
        _check('times', self.times, (count,))
        _check('positions', self.positions, (count, bones, 3))
        _check('orientations', self.orientations, (count, bones, 4))
        if self.rods is not None:
            _check('rods', self.rods, (count, *self.rods.shape[1:2], 2, 3))
        if not count or self.times[0] != 0 or (np.diff(self.times) <= 0).any():
            raise errors.OutOfRange('times', list(self.times[:4]), 'from 0 on, ascending')
        lengths = np.linalg.norm(self.orientations, axis=2)
        if (abs(lengths - 1) > UNIT_TOLERANCE).any():
            worst = self.orientations[abs(lengths - 1) > UNIT_TOLERANCE][0]
            raise errors.NotUnit('orientations', worst.tolist(), 'unit quaternions x, y, z, w')

    @property
    def duration(self) -> float:
        """Time of the last pose, s."""
        return float(self.times[-1])

    def at(self, time: float) -> RecordedPose:
        """Interpolated pose at ``time`` s, clamped to the recording.

        Positions are linear, orientations normalised linear along the shorter arc: within 0.04
        degrees of slerp for rotations of less than 30 degrees between poses.
        """
        index = int(np.clip(np.searchsorted(self.times, time, 'right') - 1, 0, len(self) - 1))
        begin = self.pose(index)
        if time <= self.times[index] or index == len(self) - 1:
            return begin
        share = (time - self.times[index]) / (self.times[index + 1] - self.times[index])
        end = self.pose(index + 1)
        near = np.where((begin.orientations * end.orientations).sum(axis=1) < 0, -1.0, 1.0)
        orientations = (1 - share) * begin.orientations + share * near[:, None] * end.orientations
        rods = None if begin.rods is None else (1 - share) * begin.rods + share * end.rods
        return RecordedPose((1 - share) * begin.positions + share * end.positions,
                            rotation.normalized(orientations), rods)

    def pose(self, index: int) -> RecordedPose:
        """Pose at ``times[index]``."""
        rods = None if self.rods is None else self.rods[index]
        return RecordedPose(self.positions[index], self.orientations[index], rods)

    def __len__(self) -> int:
        return len(self.times)


class Recorder:
    """Collects poses of one scene into a recording.

    A time that goes backwards is a reset: the recording continues at its end.

    Args:
        scene: of all the poses.

    Example:
        >>> recorder = Recorder(load_scene('drop'))
        >>> with Simulation(recorder.scene) as simulation:
        ...     recorder.take(simulation)
        >>> recorder.recording().positions.shape
        (1, 10, 3)
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._times: list[float] = []
        self._poses: list[RecordedPose] = []
        self._last = 0.0
        self._shift = 0.0

    def __len__(self) -> int:
        return len(self._poses)

    @property
    def duration(self) -> float:
        """Time of the last pose, s."""
        return self._times[-1] if self._times else 0.0

    def add(self, time: float, pose: RecordedPose) -> None:
        """Add the pose at ``time`` s, without a copy; the same time again is ignored."""
        if not self._times or time < self._last:
            self._shift = self.duration - time
        self._last = time
        if not self._times or time + self._shift > self.duration:
            self._times.append(time + self._shift)
            self._poses.append(pose)

    def take(self, simulation: Simulation) -> None:
        """Add the current poses of a simulation."""
        state, swings = simulation.state, simulation.swings
        self.add(simulation.time / SECOND, RecordedPose(state.positions, state.orientations,
                                                        None if swings is None else swings.rods))

    def recording(self) -> Recording:
        """The recording so far. Raises OutOfRange if it is empty."""
        poses = self._poses
        if not poses:
            raise errors.OutOfRange('recording', 0, 'at least one pose')
        rods = None if any(pose.rods is None for pose in poses) else np.array(
            [pose.rods for pose in poses])
        return Recording(self.scene, np.array(self._times),
                         np.array([pose.positions for pose in poses]),
                         np.array([pose.orientations for pose in poses]), rods)


def _check(key: str, array: np.ndarray, shape: tuple[int, ...]) -> None:
    """Raise WrongForm or NotFinite unless an array has the shape and is finite."""
    if array.shape != shape:
        raise errors.WrongForm(key, array.shape, f'the shape {shape}')
    if not np.isfinite(array).all():
        raise errors.NotFinite(key, array[~np.isfinite(array)][0], 'finite numbers')


class Rods:
    """Start of each rod of a scene's swings: on a bone, or the mass before it."""

    def __init__(self, scene: Scene) -> None:
        mounts, firsts = mount_swings(scene), []
        free: list[int] = []
        self.count = 0
        """Masses of all swings."""
        for mount in mounts:
            links = len(mount.swing.links)
            firsts.append(self.count)
            if mount.swing.mode == 'free':
                free += range(self.count, self.count + links)
            self.count += links
        self._bones = np.array([mount.bone for mount in mounts], int)
        self._roots = np.array([mount.root for mount in mounts]).reshape(-1, 3)
        self._firsts, self._free = np.array(firsts, int), np.array(free, int)

    def ends(self, masses: np.ndarray, state: State) -> np.ndarray:
        """Both ends (m, 2, 3) m of each rod, from the masses (m, 3) m and the bones' poses.

        Of a free mass, which has no rod, both are its position.
        """
        begins = np.concatenate([masses[:1], masses[:-1]])
        begins[self._firsts] = state.positions[self._bones] + rotation.rotate(
            state.orientations[self._bones], self._roots)
        begins[self._free] = masses[self._free]
        return np.stack([begins, masses], axis=1)


def points_y_up(points: np.ndarray) -> np.ndarray:
    """Points or vectors (..., 3) with Y up."""
    return np.asarray(points)[..., [1, 2, 0]]


def orientations_y_up(orientations: np.ndarray) -> np.ndarray:
    """Quaternions (..., 4) x, y, z, w with Y up."""
    return np.asarray(orientations)[..., [1, 2, 0, 3]]
