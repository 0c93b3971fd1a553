"""BVH (Biovision motion capture): a skeleton, and the channels of its joints over time.

Meredith and Maddock, Motion Capture File Formats Explained (2001). Angles are in degrees, in the
order of the file: R = R1 R2 R3, in the parent's axes. In the rest pose all angles are zero. A
position channel is the joint's coordinate along that axis of the parent; it replaces the OFFSET's,
as in Blender.
"""
from __future__ import annotations

import functools
import math
import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from ...model import errors, rotation

LARGEST_FILE = 64_000_000
"""Bytes; three hours of 31 joints at 10 frames a second."""

MOST_JOINTS, MOST_FRAMES = 1000, 100_000
"""Frames: 14 min at 120 per s."""

FRAME_TIMES = (1e-4, 10.0)
"""s, shortest and longest."""

LARGEST = 1e9
"""Of any number in a file."""

CHANNELS = {f'{axis}{kind}'.casefold(): (kind == 'rotation', index)
            for kind in ('position', 'rotation') for index, axis in enumerate('XYZ')}
"""Whether a channel is an angle, and its axis."""

Tokens = Iterator[tuple[int, str]]


@dataclass(frozen=True, eq=False)
class BvhJoint:
    """A joint of the skeleton: ``channels`` are pairs (is an angle, axis)."""

    name: str
    parent: int
    """Index of a joint before it, -1 for a root."""
    offset: np.ndarray
    """(3,) from the parent in the rest pose."""
    channels: tuple[tuple[bool, int], ...]
    tip: np.ndarray | None
    """(3,) from it to its End Site."""


@dataclass(frozen=True, eq=False)
class BvhFile:
    """A BVH file: its joints, parents first; ``step``, the frame time, s; and ``frames`` (k, c),
    the channels of all joints.
    """

    joints: tuple[BvhJoint, ...]
    step: float
    frames: np.ndarray

    @property
    def times(self) -> np.ndarray:
        """Times (k,) of the frames, s."""
        return self.step * np.arange(len(self.frames))

    @property
    def names(self) -> list[str]:
        """Names of the joints."""
        return [joint.name for joint in self.joints]

    @functools.cached_property
    def rest(self) -> np.ndarray:
        """(n, 3) places of the joints in the rest pose."""
        places = np.zeros((len(self.joints), 3))
        for index, joint in enumerate(self.joints):
            places[index] = joint.offset + (places[joint.parent] if joint.parent >= 0 else 0.0)
        return places

    def worlds(self, wanted: Iterable[int]) -> dict[int, tuple[np.ndarray, np.ndarray]]:
        """Return positions (k, 3) and orientations (k, 4) of the ``wanted`` joints and those above
        them in all frames, in the file's axes, by index.
        """
        needed = set()
        for index in wanted:
            while index >= 0:
                needed.add(index)
                index = self.joints[index].parent
        found: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        first = np.cumsum([0, *(len(joint.channels) for joint in self.joints)])
        for index in sorted(needed):
            joint = self.joints[index]
            place, turn = self._local(joint, self.frames[:, first[index]:first[index + 1]])
            if joint.parent >= 0:
                at, above = found[joint.parent]
                place = at + rotation.rotate(above, place)
                turn = rotation.multiply(above, turn)
            found[index] = place, turn
        return found

    @staticmethod
    def _local(joint: BvhJoint, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return position (k, 3) and orientation (k, 4) of a joint in its parent's axes, from the
        values (k, c) of its channels.
        """
        place = np.tile(joint.offset, (len(values), 1))
        turn = np.tile(rotation.IDENTITY, (len(values), 1))
        for (is_angle, axis), column in zip(joint.channels, values.T, strict=True):
            if not is_angle:
                place[:, axis] = column
                continue
            half, about = np.radians(column) / 2, np.zeros((len(values), 4))
            about[:, axis], about[:, 3] = np.sin(half), np.cos(half)
            turn = rotation.multiply(turn, about)
        return place, turn


def read_bvh(path: str) -> BvhFile:
    """Read a file, cached by its path, time of modification and size.

    Raises ModelErrors with the file's name and the line.
    """
    with errors.naming(path):
        stat = os.stat(path)
        return _read(path, (stat.st_mtime_ns, stat.st_size))


@functools.lru_cache(maxsize=4)
def _read(path: str, stamp: tuple[int, int]) -> BvhFile:
    if not os.path.isfile(path) or not path.lower().endswith('.bvh'):
        raise errors.Unreadable('', os.path.basename(path), 'a file whose name ends in .bvh')
    if stamp[1] > LARGEST_FILE:
        raise errors.Unreadable('', f'{stamp[1]} bytes', f'at most {LARGEST_FILE}')
    with open(path, 'rb') as file:
        return parse_bvh(file.read())


def parse_bvh(content: bytes) -> BvhFile:
    """Parse the content of a file. Raises a ModelError whose path is the line, or MOTION if no
    frame follows.
    """
    # Whoever may set a node's scene could read any file by an error that quotes it.
    if not re.match(rb'(\xef\xbb\xbf)?\s*HIERARCHY\b', content, re.IGNORECASE):
        raise errors.Unreadable('line 1', 'another text', 'a BVH file, which begins HIERARCHY')
    try:
        lines = content.decode('utf-8-sig').splitlines()
    except UnicodeDecodeError as error:
        line = content[:error.start].count(b'\n') + 1
        raise errors.Unreadable(f'line {line}', f'byte {error.start}', 'text in UTF-8') from None
    at = next((k for k, line in enumerate(lines) if line.strip().upper() == 'MOTION'), None)
    if at is None:
        raise errors.Unreadable(f'line {len(lines)}', 'the end of the file', 'MOTION and frames')
    joints = _skeleton(_tokens(lines[:at]))
    numbered = [(k, line) for k, line in enumerate(lines[at + 1:], at + 2) if line.strip()]
    rows = iter(numbered)
    count = _head(rows, r'Frames\s*:?\s*(\S+)', 'Frames: and their number', len(lines))
    step = _head(rows, r'Frame\s+Time\s*:?\s*(\S+)', 'Frame Time: in s', len(lines))
    for (line, value), (least, most) in ((count, (1, MOST_FRAMES)), (step, FRAME_TIMES)):
        errors.check_range(f'line {line}', value, least, most)
    if count[1] != int(count[1]):
        raise errors.WrongForm(f'line {count[0]}', count[1], 'a whole number of frames')
    frames = _frames(list(rows), int(count[1]), sum(len(joint.channels) for joint in joints))
    return BvhFile(tuple(joints), step[1], frames)


def _head(rows: Iterator[tuple[int, str]], pattern: str, expected: str,
          last: int) -> tuple[int, float]:
    """Return line number and value of the next line, which must match ``pattern``. Raises a
    ModelError.
    """
    line, text = next(rows, (last, 'the end of the file'))
    found = re.fullmatch(pattern, text.strip(), re.IGNORECASE)
    if not found:
        raise errors.WrongForm(f'line {line}', text.strip(), expected)
    return line, _number(line, found[1])


def _frames(rows: list[tuple[int, str]], count: int, channels: int) -> np.ndarray:
    """Numbers (k, c) of the frames."""
    values = np.empty((min(len(rows), count), channels))
    for k, (line, text) in enumerate(rows[:count]):
        words = text.split()
        if len(words) != channels:
            raise errors.WrongForm(f'line {line}', f'{len(words)} numbers',
                                   f'{channels}, one for each channel')
        try:
            values[k] = np.array(words, float)
        except ValueError:
            values[k] = math.nan
        if not np.abs(values[k]).max(initial=0.0) <= LARGEST:
            for word in words:
                _number(line, word)
    if len(rows) != count:
        line = rows[min(len(rows) - 1, count)][0] if rows else 0
        raise errors.WrongForm(f'line {line}' if rows else 'MOTION', f'{len(rows)} frames',
                               f'{count}, as Frames says')
    return values


def _number(line: int, word: str) -> float:
    try:
        value = float(word)
    except ValueError:
        raise errors.WrongForm(f'line {line}', word, 'a number') from None
    if not abs(value) <= LARGEST:
        raise errors.OutOfRange(f'line {line}', word, f'a number of at most {LARGEST:g}')
    return value


def _tokens(lines: list[str]) -> Tokens:
    """Words of the hierarchy with their lines, without the first, HIERARCHY."""
    words = ((line, word) for line, text in enumerate(lines, 1)
             for word in text.replace('{', ' { ').replace('}', ' } ').split())
    next(words)
    return words


class _Node:
    """A joint, or an End Site, while it is read."""

    def __init__(self, name: str, parent: int, is_tip: bool) -> None:
        self.name, self.parent, self.is_tip = name, parent, is_tip
        self.offset = np.zeros(3)
        self.channels: tuple[tuple[bool, int], ...] = ()
        self.tip: np.ndarray | None = None

    def joint(self) -> BvhJoint:
        return BvhJoint(self.name, self.parent, self.offset, self.channels, self.tip)


def _skeleton(tokens: Tokens) -> list[BvhJoint]:
    """Joints of the hierarchy."""
    nodes: list[_Node] = []
    opened: list[_Node] = []
    line = 1
    for line, word in tokens:
        key = word.upper()
        if key in ('ROOT', 'JOINT', 'END'):
            if (key == 'ROOT') == bool(opened) or (opened and opened[-1].is_tip):
                raise errors.WrongForm(f'line {line}', word, 'ROOT outside, JOINT and End within '
                                       'a joint')
            parent = nodes.index(opened[-1]) if opened else -1
            opened.append(_Node(_name(tokens, line), parent, key == 'END'))
            if key != 'END':
                nodes.append(opened[-1])
        elif not opened:
            raise errors.WrongForm(f'line {line}', word, 'ROOT or MOTION')
        elif key == 'OFFSET':
            opened[-1].offset = np.array([_number(*_next(tokens, line)) for _ in range(3)])
        elif key == 'CHANNELS' and not opened[-1].is_tip:
            opened[-1].channels = _channels(tokens, line)
        elif key == '}':
            closed = opened.pop()
            if closed.is_tip:
                nodes[closed.parent].tip = closed.offset
        else:
            raise errors.WrongForm(f'line {line}', word, 'OFFSET, CHANNELS, JOINT, End Site or }')
        if len(nodes) > MOST_JOINTS:
            raise errors.OutOfRange(f'line {line}', len(nodes), f'at most {MOST_JOINTS} joints')
    if opened or not nodes:
        raise errors.WrongForm(f'line {line}', 'the end of the hierarchy',
                               '}' if opened else 'ROOT and joints')
    return [node.joint() for node in nodes]


def _next(tokens: Tokens, line: int) -> tuple[int, str]:
    found = next(tokens, None)
    if found is None:
        raise errors.WrongForm(f'line {line}', 'the end of the hierarchy', 'the rest of it')
    return found


def _name(tokens: Tokens, line: int) -> str:
    """The words up to the opening brace."""
    words: list[str] = []
    while (found := _next(tokens, line)[1]) != '{':
        words.append(found)
    if not words:
        raise errors.WrongForm(f'line {line}', '{', 'a name')
    return ' '.join(words)


def _channels(tokens: Tokens, line: int) -> tuple[tuple[bool, int], ...]:
    line, word = _next(tokens, line)
    if word not in ('0', '1', '2', '3', '4', '5', '6'):
        raise errors.WrongForm(f'line {line}', word, 'a number of channels, at most 6')
    found = []
    for _ in range(int(word)):
        line, word = _next(tokens, line)
        if word.casefold() not in CHANNELS:
            raise errors.WrongForm(f'line {line}', word, 'Xposition, Yposition, Zposition, '
                                   'Xrotation, Yrotation or Zrotation')
        found.append(CHANNELS[word.casefold()])
    return tuple(found)
