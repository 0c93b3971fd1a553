"""A run as poses over time: recorded, written, read, and asked for the pose at any instant.

The file is JSON in UTF-8, one object:

    format        'ragdoll_ros recording'
    version       1
    frame         'world': x forward, y left, z up (REP 103)
    names         n bones, the order of all that follows
    times         k instants in s of simulated time, the first 0, each later than the last
    positions     k lists of n [x, y, z]: each bone's centre of mass, m
    orientations  k lists of n [x, y, z, w]: unit quaternions, shape's axes to the frame's
    scene         all of the scene, in the form of config/scene.schema.json, its dolls within

Numbers are written so that they read back to the same bits. JSON knows no infinity: friction
without limit is the text '.inf', as in YAML.
"""
from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .. import faults, rotation
from ..faults import Fault, Faults
from ..scene import Scene
from ..scene_file import build_scene, scene_data

FORMAT = 'ragdoll_ros recording'
VERSION = 1
FRAME = 'world'
KEYS = ('format', 'version', 'frame', 'names', 'times', 'positions', 'orientations', 'scene')

LARGEST_RECORDING = 1_000_000_000
"""Bytes; a minute of ten bones at 60 Hz takes 6 MB."""

UNIT = 1e-6
"""How far a quaternion's length may be from 1."""


@dataclass(frozen=True)
class Recording:
    """Poses of a scene's n bones at k >= 1 instants; raises a Fault for arrays that do not fit."""

    scene: Scene
    times: np.ndarray
    """(k,) s, ascending from 0."""
    positions: np.ndarray
    """(k, n, 3) m, world frame."""
    orientations: np.ndarray
    """(k, n, 4) unit quaternions x, y, z, w."""

    def __post_init__(self) -> None:
        count, bones = len(self.times), len(self.scene.bones)
        for key, shape in (('times', (count,)), ('positions', (count, bones, 3)),
                           ('orientations', (count, bones, 4))):
            array = getattr(self, key)
            if array.shape != shape:
                raise faults.WrongForm(key, array.shape, f'the shape {shape}')
            if not np.isfinite(array).all():
                raise faults.NotFinite(key, array[~np.isfinite(array)][0], 'finite numbers')
        if not count or self.times[0] != 0 or (np.diff(self.times) <= 0).any():
            raise faults.OutOfRange('times', list(self.times[:4]), 'from 0 on, ascending')
        lengths = np.linalg.norm(self.orientations, axis=2)
        if (abs(lengths - 1) > UNIT).any():
            worst = self.orientations[abs(lengths - 1) > UNIT][0]
            raise faults.NotUnit('orientations', worst.tolist(), 'unit quaternions x, y, z, w')

    @property
    def duration(self) -> float:
        """Instant of the last pose, s."""
        return float(self.times[-1])

    def at(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Positions (n, 3) m and orientations (n, 4) at ``time`` s, between poses on the way.

        Before the first and after the last pose: that one. Between two: positions on the
        straight line, orientations on the shorter arc (normalised mean, less than 0.04 degrees
        from the arc's even motion as long as a bone turns less than 30 degrees in between).
        """
        after = int(np.clip(np.searchsorted(self.times, time), 1, max(1, len(self.times) - 1)))
        if after >= len(self.times):
            return self.positions[0], self.orientations[0]
        begin, end = self.times[after - 1:after + 1]
        share = min(max((time - begin) / (end - begin), 0.0), 1.0)
        if share in (0.0, 1.0):
            exact = after - 1 + int(share)
            return self.positions[exact], self.orientations[exact]
        place = (1 - share) * self.positions[after - 1] + share * self.positions[after]
        one, other = self.orientations[after - 1:after + 1]
        near = np.where((one * other).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)
        return place, rotation.normalized((1 - share) * one + share * near * other)


class Recorder:
    """Takes poses of one scene as they come.

    Time that goes backwards is a reset: the recording goes on where it is, at the next pose.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._poses: list[tuple[float, np.ndarray, np.ndarray]] = []
        self._last = 0.0
        self._shift = 0.0

    def __len__(self) -> int:
        return len(self._poses)

    @property
    def duration(self) -> float:
        """Instant of the last pose, s."""
        return self._poses[-1][0] if self._poses else 0.0

    def add(self, time: float, positions: np.ndarray, orientations: np.ndarray) -> None:
        """Take the pose at ``time`` s: (n, 3) m and (n, 4); the same instant again is left out."""
        if not self._poses or time < self._last:
            self._shift = self.duration - time
        self._last = time
        if not self._poses or time + self._shift > self.duration:
            self._poses.append((time + self._shift, positions.copy(), orientations.copy()))

    def recording(self) -> Recording:
        """Give what was taken; OutOfRange if that is nothing."""
        if not self._poses:
            raise faults.OutOfRange('recording', 0, 'at least one pose')
        times, positions, orientations = zip(*self._poses, strict=True)
        return Recording(self.scene, np.array(times), np.array(positions), np.array(orientations))


def recording_text(recording: Recording) -> str:
    """Give the JSON of a recording."""
    return json.dumps({
        'format': FORMAT, 'version': VERSION, 'frame': FRAME,
        'names': list(recording.scene.bone_names), 'times': recording.times.tolist(),
        'positions': recording.positions.tolist(),
        'orientations': recording.orientations.tolist(),
        'scene': _without_infinity(scene_data(recording.scene))}, allow_nan=False)


def save_recording(recording: Recording, path: str | Path) -> None:
    """Write a recording; load_recording gives an equal one back."""
    Path(path).write_text(recording_text(recording), encoding='utf-8')


def load_recording(path: str | Path) -> Recording:
    """Read a recording; Faults with the file's name and what is wrong in it."""
    path = Path(path)
    try:
        return _recording(_read(path), path)
    except Fault as fault:
        raise Faults(str(path), [fault]) from None


def _read(path: Path) -> dict:
    try:
        size = path.stat().st_size
        if size > LARGEST_RECORDING:
            raise faults.OutOfRange('', f'{size} bytes', f'at most {LARGEST_RECORDING}')
        data = json.loads(path.read_text(encoding='utf-8'), parse_constant=_no_constant)
    except OSError as error:
        raise faults.Unreadable('', error.strerror, 'a recording, run.json') from None
    except (UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
        raise faults.Unreadable('', str(error), 'JSON in UTF-8') from None
    if not isinstance(data, dict) or data.get('format') != FORMAT:
        said = data.get('format') if isinstance(data, dict) else type(data).__name__
        raise faults.WrongForm('format', said, repr(FORMAT))
    return data


def _no_constant(text: str) -> None:
    raise faults.NotFinite('', text, 'finite numbers')


def _recording(data: dict, path: Path) -> Recording:
    for key, only in (('version', VERSION), ('frame', FRAME)):
        if data.get(key) != only:
            raise faults.OutOfRange(key, data.get(key), repr(only))
    if set(data) != set(KEYS):
        odd = sorted(set(data) ^ set(KEYS))
        raise faults.WrongForm('', odd, 'the keys ' + ', '.join(KEYS))
    scene, found = build_scene(_with_infinity(data['scene']), path)
    if found:
        raise Faults(str(path), [fault.at('scene') for fault in found])
    if data['names'] != list(scene.bone_names):
        raise faults.UnknownBone('names', data['names'],
                                 "the scene's bones, " + ', '.join(scene.bone_names))
    return Recording(scene, *(_array(data, key) for key in KEYS[4:7]))


def _array(data: dict, key: str) -> np.ndarray:
    """Numbers in nested lists of even lengths as float64."""
    try:
        array = np.array(data[key])
        if array.dtype.kind in 'iuf':
            return array.astype(float)
    except (ValueError, OverflowError):
        pass
    raise faults.WrongForm(key, data[key], 'lists of numbers, all of one length')


def _without_infinity(value: object) -> object:
    if isinstance(value, dict):
        return {key: _without_infinity(each) for key, each in value.items()}
    if isinstance(value, list):
        return [_without_infinity(each) for each in value]
    return '.inf' if value == float('inf') else value


def _with_infinity(value: object) -> object:
    """Undo _without_infinity; only a friction can be without limit, a name stays a name."""
    if isinstance(value, dict):
        return {key: float('inf') if key == 'friction' and each == '.inf'
                else _with_infinity(each) for key, each in value.items()}
    return [_with_infinity(each) for each in value] if isinstance(value, list) else value
