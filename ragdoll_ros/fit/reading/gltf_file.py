"""The container of a glTF 2.0 file: its JSON, and where the bytes of its buffers lie.

Nothing is read but the JSON and the bytes an accessor asks for, and nothing is believed: every
length is held against the file's own size, and what the JSON says is checked where it is read.
The chunks are those of section 4.4 of the glTF 2.0 specification.
"""
from __future__ import annotations

import base64
import binascii
import json
import os
import struct
import urllib.parse
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from ...model import errors

LARGEST_JSON = 32_000_000
"""Bytes of JSON; a character with hundreds of animations has 2 MB."""

LARGEST_STRUCTURE = 500_000
"""Commas and brackets in the JSON: what becomes Python objects, 64 bytes each and more."""

UNREADABLE_EXTENSIONS = ('EXT_meshopt_compression', 'KHR_meshopt_compression')
"""Of what is on PyPI for them only meshopt (first released in October 2026) has wheels, from
Python 3.11 on."""

LARGEST_WHOLE = 2 ** 53
"""Whole numbers of the JSON stay below (section 2.7 of the specification)."""

LISTS = ('nodes', 'skins', 'meshes', 'accessors', 'bufferViews', 'buffers')
"""The parts of a document that are read: lists of objects that name each other by index."""


@dataclass(frozen=True)
class Buffer:
    """Where one buffer's ``size`` bytes are: in ``path`` from byte ``start``, or in ``data``."""

    size: int
    path: Path | None = None
    start: int = 0
    data: bytes = b''

    def read(self, offset: int, size: int, where: str) -> bytes:
        """Return ``size`` bytes from ``offset`` on; Unreadable where the file ends before."""
        if self.path is None:
            return self.data[offset:offset + size]
        with self.path.open('rb') as file:
            file.seek(self.start + offset)
            data = file.read(size)
        if len(data) < size:
            raise errors.Unreadable(where, f'{len(data)} bytes', f'{size} bytes, file is cut short')
        return data


class GltfFile:
    """A .glb or .gltf file: its ``json``, whose LISTS are lists of objects, and its buffers.

    A ModelError says what keeps it from being one; OSError where it cannot be opened.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        if not self.path.is_file():
            there = 'not a regular file' if self.path.exists() else 'no such file'
            raise errors.Unreadable('', there, 'a .glb or .gltf file')
        self.size = os.stat(self.path).st_size
        with self.path.open('rb') as file:
            head = file.read(4)
        binary = head == b'glTF'
        if not binary and self.path.suffix.lower() == '.glb':
            raise errors.Unreadable('byte 0', head.decode('ascii', 'backslashreplace'),
                                    'glTF, as a .glb begins')
        text, self._chunk = self._read_chunks() if binary else (self._read_text(), None)
        self.json = _parse(text)
        self._buffers: dict[int, Buffer] = {}

    def entry(self, key: str, index: object, where: str) -> dict:
        """Return the object at an index of one of the LISTS; OutOfRange if it is no index."""
        entries = self.json[key]
        if type(index) is not int or not 0 <= index < len(entries):
            raise errors.OutOfRange(
                where, index, f'an index from 0 to {len(entries) - 1} in {key}' if entries
                else f'{key} in the file')
        return entries[index]

    def read(self, view_index: object, offset: int, size: int, where: str) -> bytes:
        """Return ``size`` bytes of a buffer view from ``offset`` on.

        OutOfRange where they leave the view, the view its buffer, or the buffer its file.
        """
        view = self.entry('bufferViews', view_index, where)
        place = f'bufferViews[{view_index}]'
        start, length = count(view, 'byteOffset', place, 0), count(view, 'byteLength', place)
        if offset < 0 or offset + size > length:
            raise errors.OutOfRange(where, f'bytes {offset} to {offset + size}',
                                    f'within the {length} bytes of {place}')
        buffer = self._buffer(view.get('buffer'), place)
        if start + length > buffer.size:
            raise errors.OutOfRange(place, f'bytes {start} to {start + length}',
                                    f'within the {buffer.size} bytes of the buffer')
        return buffer.read(start + offset, size, place)

    def add_view(self, data: bytes) -> int:
        """Index of a new buffer view, of all of a new buffer that holds ``data``."""
        buffers, views = self.json['buffers'], self.json['bufferViews']
        self._buffers[len(buffers)] = Buffer(len(data), data=data)
        buffers.append({'byteLength': len(data)})
        views.append({'buffer': len(buffers) - 1, 'byteLength': len(data)})
        return len(views) - 1

    def _buffer(self, index: object, where: str) -> Buffer:
        entry = self.entry('buffers', index, where)
        if index not in self._buffers:
            self._buffers[index] = self._open_buffer(entry, f'buffers[{index}]')
        return self._buffers[index]

    def _open_buffer(self, entry: dict, where: str) -> Buffer:
        wanted, uri = count(entry, 'byteLength', where), entry.get('uri')
        if uri is None:
            if self._chunk is None:
                raise errors.WrongForm(where, None, 'a uri, or a binary chunk in the file')
            buffer = self._chunk
        elif not isinstance(uri, str):
            raise errors.WrongForm(f'{where}.uri', uri, 'a text')
        elif uri.startswith('data:'):
            buffer = embedded(uri, where)
        else:
            path = inside(self.path.parent, uri, where)
            buffer = Buffer(path.stat().st_size, path)
        if wanted > buffer.size:
            raise errors.OutOfRange(f'{where}.byteLength', wanted,
                                    f'at most the {buffer.size} bytes there are')
        return buffer

    def _read_text(self) -> bytes:
        if self.size > LARGEST_JSON:
            raise errors.Unreadable('', f'{self.size} bytes', f'at most {LARGEST_JSON} of JSON')
        return self.path.read_bytes()

    def _read_chunks(self) -> tuple[bytes, Buffer | None]:
        """Bytes of the JSON chunk, and where the binary chunk lies."""
        with self.path.open('rb') as file:
            header = file.read(12)
            if len(header) < 12:
                raise errors.Unreadable('header', f'{len(header)} bytes', '12 bytes of header')
            _, version, length = struct.unpack('<4sII', header)
            if version != 2:
                raise errors.WrongForm('header.version', version, '2')
            if length > self.size:
                raise errors.Unreadable('header.length', length,
                                        f'at most the {self.size} bytes of the file')
            kind, start, size = self._chunk_head(file, 12)
            if kind != b'JSON':
                raise errors.WrongForm('byte 16', kind, 'a JSON chunk first')
            if size > LARGEST_JSON:
                raise errors.Unreadable('byte 12', size, f'at most {LARGEST_JSON} bytes of JSON')
            text = file.read(size)
            # Chunks begin on multiples of four bytes.
            after = start + size + -size % 4
            if after + 8 > length:
                return text, None
            file.seek(after)
            kind, start, size = self._chunk_head(file, after)
        return text, Buffer(size, self.path, start) if kind == b'BIN\0' else None

    def _chunk_head(self, file: BinaryIO, at: int) -> tuple[bytes, int, int]:
        head = file.read(8)
        if len(head) < 8:
            raise errors.Unreadable(f'byte {at}', f'{len(head)} bytes', 'a chunk')
        size, kind = struct.unpack('<I4s', head)
        if at + 8 + size > self.size:
            raise errors.Unreadable(f'byte {at}', f'a chunk of {size} bytes',
                                    f'at most the {self.size - at - 8} bytes that are left')
        return kind, at + 8, size


def nested(entry: dict, key: str, kind: type, where: str) -> dict | list:
    """Value of a key, of ``kind`` dict or list; empty where there is none, else WrongForm."""
    value = entry.get(key)
    if value is None:
        return kind()
    if not isinstance(value, kind):
        expected = 'an object' if kind is dict else 'a list'
        raise errors.WrongForm(f'{where}.{key}'.lstrip('.'), value, expected)
    return value


def objects(entry: dict, key: str, where: str = '') -> list[dict]:
    """Value of a key, a list of objects; empty where there is none, WrongForm for another."""
    values = nested(entry, key, list, where)
    for index, value in enumerate(values):
        if not isinstance(value, dict):
            raise errors.WrongForm(f'{where}.{key}[{index}]'.lstrip('.'), value, 'an object')
    return values


def count(entry: dict, key: str, where: str, default: int | None = None) -> int:
    """Number of things or bytes under a key; WrongForm unless it is whole and not negative."""
    value = entry.get(key)
    value = default if value is None else value
    if type(value) is not int or not 0 <= value < LARGEST_WHOLE:
        raise errors.WrongForm(f'{where}.{key}', value, 'a whole number, zero or above')
    return value


def _parse(text: bytes) -> dict:
    if sum(text.count(mark) for mark in (b',', b'[', b'{')) > LARGEST_STRUCTURE:
        raise errors.Unreadable('JSON', 'too many entries', f'at most {LARGEST_STRUCTURE}')
    try:
        data = json.loads(text.decode('utf-8').rstrip('\0'))
    except RecursionError:
        raise errors.Unreadable('JSON', 'nested too deeply', 'a glTF document') from None
    except ValueError as error:
        raise errors.Unreadable('JSON', str(error), 'JSON in UTF-8') from None
    if not isinstance(data, dict):
        raise errors.WrongForm('JSON', data, 'an object with nodes, skins and meshes')
    for extension in nested(data, 'extensionsRequired', list, ''):
        if extension in UNREADABLE_EXTENSIONS:
            raise errors.WrongForm('extensionsRequired', extension,
                                   'an uncompressed file: export it without compression')
    return data | {key: objects(data, key) for key in LISTS}


def embedded(uri: str, where: str) -> Buffer:
    """What a data: URI holds; WrongForm where that is not base64."""
    head, comma, body = uri.partition(',')
    try:
        if not comma or not head.endswith(';base64'):
            raise ValueError
        data = base64.b64decode(body, validate=True)
    except (binascii.Error, ValueError):
        raise errors.WrongForm(f'{where}.uri', uri[:40], 'data:...;base64,...') from None
    return Buffer(len(data), data=data)


def inside(folder: Path, uri: str, where: str) -> Path:
    """Path of a file of its own; it must lie in the folder of the glTF file, else Unreadable."""
    home = folder.resolve()
    try:
        path = (home / urllib.parse.unquote(uri)).resolve()
        inside, there = path.is_relative_to(home), path.is_file()
    except (ValueError, OSError, RuntimeError):
        inside = there = False
    if not inside:
        raise errors.Unreadable(f'{where}.uri', uri, f'a file inside {folder}')
    if not there:
        raise errors.Unreadable(f'{where}.uri', uri, f'a file that exists in {folder}')
    return path
