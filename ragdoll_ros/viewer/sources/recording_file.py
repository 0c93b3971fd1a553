"""Recordings as files.

JSON in UTF-8, one object:

    format        'ragdoll_ros recording'
    version       1
    frame         'world': x forward, y left, z up (REP 103)
    names         n bones, the order of all that follows
    times         k instants in s of simulated time, the first 0, each later than the last
    positions     k lists of n [x, y, z]: each bone's centre of mass, m
    orientations  k lists of n [x, y, z, w]: unit quaternions, shape's axes to the frame's
    rods          k lists of m [[x, y, z], [x, y, z]]: both ends of each rod of the scene's
                  swings, m; null for a scene without any, or where they were not told
    scene         all of the scene, in the form of config/scene.schema.json, its dolls within

Numbers are written so that they read back to the same bits. JSON knows no infinity: friction
without limit is the text '.inf', as in YAML.
"""
from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from ...files.scene import build_scene, scene_data
from ...model import errors
from ...model.errors import ModelError, ModelErrors
from .recording import Recording

FORMAT = 'ragdoll_ros recording'
VERSION = 1
FRAME = 'world'
KEYS = ('format', 'version', 'frame', 'names', 'times', 'positions', 'orientations', 'rods',
        'scene')

LARGEST_RECORDING = 1_000_000_000
"""Bytes; a minute of ten bones at 60 Hz takes 6 MB."""


def recording_text(recording: Recording) -> str:
    """A recording as JSON, from which load_recording makes an equal one."""
    return json.dumps({
        'format': FORMAT, 'version': VERSION, 'frame': FRAME,
        'names': list(recording.scene.bone_names), 'times': recording.times.tolist(),
        'positions': recording.positions.tolist(),
        'orientations': recording.orientations.tolist(),
        'rods': None if recording.rods is None else recording.rods.tolist(),
        'scene': _without_infinity(scene_data(recording.scene))}, allow_nan=False)


def load_recording(path: str | Path) -> Recording:
    """Read a recording; ModelErrors with the file's name and what is wrong in it."""
    path = Path(path)
    try:
        return _recording(_read(path), path)
    except ModelError as error:
        raise ModelErrors(str(path), [error]) from None


def _read(path: Path) -> dict:
    try:
        size = path.stat().st_size
        if size > LARGEST_RECORDING:
            raise errors.OutOfRange('', f'{size} bytes', f'at most {LARGEST_RECORDING}')
        data = json.loads(path.read_text(encoding='utf-8'), parse_constant=_no_constant)
    except OSError as error:
        raise errors.Unreadable('', error.strerror, 'a recording, run.json') from None
    except (UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
        raise errors.Unreadable('', str(error), 'JSON in UTF-8') from None
    if not isinstance(data, dict) or data.get('format') != FORMAT:
        said = data.get('format') if isinstance(data, dict) else type(data).__name__
        raise errors.WrongForm('format', said, repr(FORMAT))
    return data


def _no_constant(text: str) -> None:
    raise errors.NotFinite('', text, 'finite numbers')


def _recording(data: dict, path: Path) -> Recording:
    for key, only in (('version', VERSION), ('frame', FRAME)):
        if data.get(key) != only:
            raise errors.OutOfRange(key, data.get(key), repr(only))
    if set(data) != set(KEYS):
        odd = sorted(set(data) ^ set(KEYS))
        raise errors.WrongForm('', odd, 'the keys ' + ', '.join(KEYS))
    scene, found = build_scene(_with_infinity(data['scene']), path)
    if found:
        raise ModelErrors(str(path), [error.at('scene') for error in found])
    if data['names'] != list(scene.bone_names):
        raise errors.UnknownBone('names', data['names'],
                                 "the scene's bones, " + ', '.join(scene.bone_names))
    rods = None if data['rods'] is None else _array(data, 'rods')
    return Recording(scene, _array(data, 'times'), _array(data, 'positions'),
                     _array(data, 'orientations'), rods)


def _array(data: dict, key: str) -> np.ndarray:
    """Numbers in nested lists of even lengths as float64."""
    try:
        array = np.array(data[key])
        if array.dtype.kind in 'iuf':
            return array.astype(float)
    except (ValueError, OverflowError):
        pass
    raise errors.WrongForm(key, data[key], 'lists of numbers, all of one length')


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
