"""Animations of a glTF file: local transforms of its nodes over time, and their derivatives.

Section 3.11 (Animations) and appendix C (Animation Sampler Interpolation Modes) of the glTF 2.0
specification. The derivative is that of the interpolation: constant between LINEAR keys (of
rotations, the angular velocity is), zero for STEP keys, that of the spline for CUBICSPLINE keys; at
a key, the mean of both sides. Before its first key and after its last, a track is constant.

Most files are baked: LINEAR keys at 24 or 30 a second, between which velocities would be those of
chords. Such keys are read as samples of a smooth motion: a cubic spline through them, whose slopes
are centred differences of order 4, near the ends of order 2.
"""
from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ...model import errors, rotation
from ..key_track import KeyTrack
from .accessors import read_floats
from .gltf_file import GltfFile, get_container, get_count, get_objects
from .nodes import Nodes, local_parts

MAX_ANIMATIONS, MAX_KEYS = 2000, 2_000_000
"""Animations of a file, and keys of one: 1500 bones for 20 s at 60 frames a second."""

LONGEST_SAMPLE, EQUAL_STEPS = 0.1, 0.01
"""LINEAR keys are samples if no two are farther apart, s, and their steps differ by less than this
share."""

PROPERTIES = {'translation': 'VEC3', 'rotation': 'VEC4', 'scale': 'VEC3'}
"""Type of the values of each animated property of a node."""

INTERPOLATIONS = ('LINEAR', 'STEP', 'CUBICSPLINE')


@dataclass(frozen=True, eq=False)
class NodeAnimation:
    """An animation of a file. Its tracks are read when they are first needed: of hundreds of
    animations of a game's character, a scene wants one.
    """

    file: GltfFile
    entry: dict
    where: str

    @functools.cached_property
    def tracks(self) -> dict[tuple[int, str], KeyTrack]:
        """Tracks by node and property. Raises a ModelError for a broken one."""
        return _read_tracks(self.file, self.entry, self.where)

    @property
    def duration(self) -> float:
        """Duration, s, from 0 to the last key."""
        return max(float(track.times[-1]) for track in self.tracks.values())

    def worlds(self, nodes: Nodes, times: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Global transforms (n, ..., 4, 4) of all nodes at ``times`` (...), and their derivatives
        per s.
        """
        moved = {node for node, _ in self.tracks}
        worlds, rates = np.zeros((2, len(nodes.order), *np.shape(times), 4, 4))
        for node in nodes.order:
            local, rate = (self._local(node, times) if node in moved
                           else (nodes.locals[node], np.zeros((4, 4))))
            up = nodes.parents[node]
            worlds[node], rates[node] = (local, rate) if up < 0 else (
                worlds[up] @ local, rates[up] @ local + worlds[up] @ rate)
        return worlds, rates

    def _local(self, node: int, times: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Local transforms (..., 4, 4) of a node and their derivatives."""
        parts = local_parts(self.file.json['nodes'][node], f'nodes[{node}]')
        found = {key: self.tracks[node, key].at(times) if (node, key) in self.tracks
                 else (value, np.zeros_like(value)) for key, value in parts.items()}
        (move, moves), (q, changes), (scale, grows) = (found[key] for key in PROPERTIES)
        turn = rotation.matrix(q)
        # A rotation matrix is quadratic in the quaternion.
        turns = (rotation.matrix(q + changes) - rotation.matrix(q - changes)) / 2
        local, rate = np.zeros((2, *np.shape(times), 4, 4))
        scale, grows = scale[..., None, :], grows[..., None, :]
        local[..., :3, :3], local[..., :3, 3], local[..., 3, 3] = turn * scale, move, 1.0
        rate[..., :3, :3], rate[..., :3, 3] = turns * scale + turn * grows, moves
        return local, rate


def read_animations(file: GltfFile) -> list[NodeAnimation]:
    """All animations of a file that move nodes. Raises a ModelError for a broken one."""
    entries = get_objects(file.json, 'animations')
    if len(entries) > MAX_ANIMATIONS:
        raise errors.OutOfRange('animations', len(entries), f'at most {MAX_ANIMATIONS}')
    found = [NodeAnimation(file, entry, f'animations[{index}]')
             for index, entry in enumerate(entries)]
    return [each for each in found if _node_channels(each.entry, each.where)]


def _node_channels(entry: dict, where: str) -> list[tuple[dict, dict, str]]:
    """Channels that move nodes, with their targets and their places in the file.

    Weights of morph targets move none, and an extension may define other targets.
    """
    found = []
    for number, channel in enumerate(get_objects(entry, 'channels', where)):
        target = get_container(channel, 'target', dict, f'{where}.channels[{number}]')
        if target.get('path') in tuple(PROPERTIES) and target.get('node') is not None:
            found.append((channel, target, f'{where}.channels[{number}]'))
    return found


def _read_tracks(file: GltfFile, entry: dict, where: str) -> dict[tuple[int, str], KeyTrack]:
    samplers = get_objects(entry, 'samplers', where)
    tracks: dict[tuple[int, str], KeyTrack] = {}
    total = 0
    for channel, target, place in _node_channels(entry, where):
        file.entry('nodes', target['node'], f'{place}.target.node')
        sampler = get_count(channel, 'sampler', place)
        if sampler >= len(samplers):
            raise errors.OutOfRange(f'{place}.sampler', sampler,
                                    f'an index below {len(samplers)} in samplers')
        track = _read_track(file, samplers[sampler], target['path'],
                            f'{where}.samplers[{sampler}]')
        total += len(track.times)
        if total > MAX_KEYS:
            raise errors.OutOfRange(where, f'{total} keys', f'at most {MAX_KEYS}')
        tracks[target['node'], target['path']] = track
    return tracks


def _read_track(file: GltfFile, sampler: dict, key: str, where: str) -> KeyTrack:
    interpolation = sampler.get('interpolation', 'LINEAR')
    if interpolation not in INTERPOLATIONS:
        raise errors.WrongForm(f'{where}.interpolation', interpolation,
                               'one of ' + ', '.join(INTERPOLATIONS))
    times = read_floats(file, sampler.get('input'), 'SCALAR', f'{where}.input')[:, 0]
    values = read_floats(file, sampler.get('output'), PROPERTIES[key], f'{where}.output')
    each = 3 if interpolation == 'CUBICSPLINE' else 1
    if len(times) == 0 or len(values) != each * len(times):
        raise errors.WrongForm(f'{where}.output', f'{len(values)} values',
                               f'{each} for each of {len(times)} keys, at least one key')
    if times[0] < 0 or (np.diff(times) <= 0).any():
        raise errors.WrongForm(f'{where}.input', 'times of keys',
                               'times from 0 on, each later than the one before')
    values = values.reshape(len(times), each, -1)
    if key == 'rotation' and (np.linalg.norm(values[:, each // 2], axis=1) < 1e-9).any():
        raise errors.NotUnit(f'{where}.output', 0.0, 'quaternions x, y, z, w, not zero')
    if interpolation == 'LINEAR' and _are_samples(times):
        return KeyTrack.sampled(times, values[:, 0], key == 'rotation')
    if each == 1:
        values = np.pad(values, ((0, 0), (1, 1), (0, 0)))
    return KeyTrack(times, values, interpolation, key == 'rotation')


def _are_samples(times: np.ndarray) -> bool:
    steps = np.diff(times)
    return len(steps) >= 4 and steps.max() <= min(
        LONGEST_SAMPLE, (1 + EQUAL_STEPS) * steps.min())
