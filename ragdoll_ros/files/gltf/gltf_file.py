"""Container of a glTF 2.0 file: its JSON and its buffers.

Reads the JSON and the requested bytes only, and trusts nothing: lengths are checked against the
file's size, and JSON values where they are read. Section 4.4 of the glTF 2.0 specification has
the chunks.
"""
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

MAX_JSON_BYTES = 32_000_000
"""Bytes of JSON; a character with hundreds of animations has 2 MB."""

MAX_JSON_TOKENS = 500_000
"""Commas and brackets of the JSON: each becomes a Python object of 64 bytes or more."""

UNSUPPORTED_EXTENSIONS = ('EXT_meshopt_compression', 'KHR_meshopt_compression')
"""The only decoder with wheels on PyPI is meshopt (since October 2026), for Python 3.12 and up."""

MAX_INTEGER = 2 ** 53
"""Upper bound of integers in the JSON (section 2.7 of the specification)."""

INDEXED_LISTS = ('nodes', 'skins', 'meshes', 'accessors', 'bufferViews', 'buffers')
"""Top-level lists of objects that refer to each other by index."""


@dataclass(frozen=True)
class Buffer:
    """A buffer of ``size`` bytes: in ``path`` from byte ``start``, or in ``data``."""

    size: int
    path: Path | None = None
    start: int = 0
    data: bytes = b''

    def read(self, offset: int, size: int, where: str) -> bytes:
        """Return ``size`` bytes from ``offset`` on; raises Unreadable for a truncated file."""
        if self.path is None:
            return self.data[offset:offset + size]
        with self.path.open('rb') as file:
            file.seek(self.start + offset)
            data = file.read(size)
        if len(data) < size:
            raise errors.Unreadable(where, f'{len(data)} bytes', f'{size} bytes, file is cut short')
        return data


class GltfFile:
    """A .glb or .gltf file: ``json``, with INDEXED_LISTS as lists of objects, and its buffers.

    Raises a ModelError for a file of another format, OSError where it cannot be opened.
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
        if not binary and self.size > MAX_JSON_BYTES:
            raise errors.Unreadable('', f'{self.size} bytes', f'at most {MAX_JSON_BYTES} of JSON')
        text, self._chunk = self._read_chunks() if binary else (self.path.read_bytes(), None)
        self.json = _parse(text)
        self._buffers: dict[int, Buffer] = {}

    def entry(self, key: str, index: object, where: str) -> dict:
        """Return an object of one of the INDEXED_LISTS; raises OutOfRange for a wrong index."""
        entries = self.json[key]
        if type(index) is not int or not 0 <= index < len(entries):
            raise errors.OutOfRange(
                where, index, f'an index from 0 to {len(entries) - 1} in {key}' if entries
                else f'{key} in the file')
        return entries[index]

    def read(self, view_index: object, offset: int, size: int, where: str) -> bytes:
        """Return ``size`` bytes of a buffer view from ``offset`` on.

        Raises OutOfRange where they exceed the view, or the view its buffer.
        """
        view = self.entry('bufferViews', view_index, where)
        place = f'bufferViews[{view_index}]'
        start = get_count(view, 'byteOffset', place, 0)
        length = get_count(view, 'byteLength', place)
        if offset < 0 or offset + size > length:
            raise errors.OutOfRange(where, f'bytes {offset} to {offset + size}',
                                    f'within the {length} bytes of {place}')
        number = view.get('buffer')
        entry = self.entry('buffers', number, place)
        if number not in self._buffers:
            self._buffers[number] = self._open_buffer(entry, f'buffers[{number}]')
        buffer = self._buffers[number]
        if start + length > buffer.size:
            raise errors.OutOfRange(place, f'bytes {start} to {start + length}',
                                    f'within the {buffer.size} bytes of the buffer')
        return buffer.read(start + offset, size, place)

    def add_view(self, data: bytes) -> int:
        """Index of a new buffer view, all of a new buffer with the given data."""
        buffers, views = self.json['buffers'], self.json['bufferViews']
        self._buffers[len(buffers)] = Buffer(len(data), data=data)
        buffers.append({'byteLength': len(data)})
        views.append({'buffer': len(buffers) - 1, 'byteLength': len(data)})
        return len(views) - 1

    def _open_buffer(self, entry: dict, where: str) -> Buffer:
        length, uri = get_count(entry, 'byteLength', where), entry.get('uri')
        if uri is None:
            if self._chunk is None:
                raise errors.WrongForm(where, None, 'a uri, or a binary chunk in the file')
            buffer = self._chunk
        elif not isinstance(uri, str):
            raise errors.WrongForm(f'{where}.uri', uri, 'a string')
        elif uri.startswith('data:'):
            buffer = decode_data_uri(uri, where)
        else:
            path = resolve_uri(self.path.parent, uri, where)
            buffer = Buffer(path.stat().st_size, path)
        if length > buffer.size:
            raise errors.OutOfRange(f'{where}.byteLength', length, f'at most {buffer.size} bytes')
        return buffer

    def _read_chunks(self) -> tuple[bytes, Buffer | None]:
        """Bytes of the JSON chunk, and the binary chunk if there is one."""
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
            kind, start, size = self._read_chunk_header(file, 12)
            if kind != b'JSON':
                raise errors.WrongForm('byte 16', kind, 'a JSON chunk first')
            if size > MAX_JSON_BYTES:
                raise errors.Unreadable('byte 12', size, f'at most {MAX_JSON_BYTES} bytes of JSON')
            text = file.read(size)
            # Chunks are aligned to four bytes.
            after = start + size + -size % 4
            if after + 8 > length:
                return text, None
            file.seek(after)
            kind, start, size = self._read_chunk_header(file, after)
        return text, Buffer(size, self.path, start) if kind == b'BIN\0' else None

    def _read_chunk_header(self, file: BinaryIO, at: int) -> tuple[bytes, int, int]:
        head = file.read(8)
        if len(head) < 8:
            raise errors.Unreadable(f'byte {at}', f'{len(head)} bytes', 'a chunk')
        size, kind = struct.unpack('<I4s', head)
        if at + 8 + size > self.size:
            raise errors.Unreadable(f'byte {at}', f'a chunk of {size} bytes',
                                    f'at most the {self.size - at - 8} bytes that are left')
        return kind, at + 8, size


def get_container(entry: dict, key: str, kind: type, where: str) -> dict | list:
    """Return the value of a key, a dict or list as ``kind`` says; empty where missing. Raises
    WrongForm for another type.
    """
    value = entry.get(key)
    if value is None:
        return kind()
    if not isinstance(value, kind):
        expected = 'an object' if kind is dict else 'a list'
        raise errors.WrongForm(f'{where}.{key}'.lstrip('.'), value, expected)
    return value


def get_objects(entry: dict, key: str, where: str = '') -> list[dict]:
    """Value of a key, a list of objects; empty where missing, WrongForm for another type."""
    values = get_container(entry, key, list, where)
    for index, value in enumerate(values):
        if not isinstance(value, dict):
            raise errors.WrongForm(f'{where}.{key}[{index}]'.lstrip('.'), value, 'an object')
    return values


def get_count(entry: dict, key: str, where: str, default: int | None = None) -> int:
    """Value of a key, a count, length or offset; WrongForm unless a non-negative integer."""
    value = entry.get(key)
    value = default if value is None else value
    if type(value) is not int or not 0 <= value < MAX_INTEGER:
        raise errors.WrongForm(f'{where}.{key}', value, 'a whole number, zero or above')
    return value


def _parse(text: bytes) -> dict:
    if sum(text.count(mark) for mark in (b',', b'[', b'{')) > MAX_JSON_TOKENS:
        raise errors.Unreadable('JSON', 'too many entries', f'at most {MAX_JSON_TOKENS}')
    try:
        data = json.loads(text.decode('utf-8').rstrip('\0'))
    except RecursionError:
        raise errors.Unreadable('JSON', 'nested too deeply', 'a glTF document') from None
    except ValueError as error:
        raise errors.Unreadable('JSON', str(error), 'JSON in UTF-8') from None
    if not isinstance(data, dict):
        raise errors.WrongForm('JSON', data, 'an object with nodes, skins and meshes')
    for extension in get_container(data, 'extensionsRequired', list, ''):
        if extension in UNSUPPORTED_EXTENSIONS:
            raise errors.WrongForm('extensionsRequired', extension,
                                   'a file without meshopt compression: export it so, or undo it '
                                   'by `npx @gltf-transform/cli copy IN.glb OUT.glb`')
    return data | {key: get_objects(data, key) for key in INDEXED_LISTS}


def decode_data_uri(uri: str, where: str) -> Buffer:
    """Contents of a base64 data: URI; raises WrongForm for another encoding."""
    head, comma, body = uri.partition(',')
    try:
        if not comma or not head.endswith(';base64'):
            raise ValueError
        data = base64.b64decode(body, validate=True)
    except (binascii.Error, ValueError):
        raise errors.WrongForm(f'{where}.uri', uri[:40], 'data:...;base64,...') from None
    return Buffer(len(data), data=data)


def resolve_uri(folder: Path, uri: str, where: str) -> Path:
    """Path of a URI, a file in the folder of the glTF file; raises Unreadable for any other."""
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
