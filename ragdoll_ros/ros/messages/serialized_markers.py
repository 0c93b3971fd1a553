"""A MarkerArray assembled from serialized blocks that equal dolls share.

CDR aligns float64 to eight bytes, so the bytes of a block depend on its offset modulo eight: a
block is serialized behind a marker that ends at an equivalent offset.
"""
from __future__ import annotations

import struct
from collections.abc import Callable

import numpy as np
from rclpy.serialization import serialize_message
from visualization_msgs.msg import Marker, MarkerArray

from ...model.scene import SECOND
from .serialized import CDR_HEADER, STAMP_SENTINEL, SerializedTemplate

STAMP = struct.pack('=iI', *divmod(STAMP_SENTINEL, SECOND))

MakeMarkers = Callable[[str], tuple[list[Marker], np.ndarray]]


class MarkerBlock:
    """Markers serialized for an offset of ``end`` bytes in a MarkerArray.

    Each marker has the stamp STAMP_SENTINEL and contains its row of ``numbers`` (markers, k).
    ``stamps``, ``names`` and ``numbers`` are byte offsets in ``data``: of each marker's stamp, of
    its namespace, and of each number, row by row.
    """

    def __init__(self, end: int, markers: list[Marker], numbers: np.ndarray) -> None:
        self.data, self.count = serialize_behind(end, markers), len(markers)
        self.stamps, self.names, rows, at = [], [], [], 0
        for marker, row in zip(markers, numbers, strict=True):
            self.stamps.append(self.data.index(STAMP, at))
            name = marker.ns.encode() + b'\0'
            at = self.data.index(struct.pack('=I', len(name)) + name, self.stamps[-1]) + 4
            self.names.append(at)
            rows.append(self.data.index(row.tobytes(), at))
        self.numbers = (np.array(rows)[:, None] + 8 * np.arange(numbers.shape[1])).ravel()

    def with_prefix(self, prefix: bytes) -> bytes:
        """The data with this prefix at the start of each namespace."""
        data = bytearray(self.data)
        for at in self.names:
            data[at:at + len(prefix)] = prefix
        return bytes(data)


class MarkerArrayBuilder:
    """A serialized MarkerArray that grows, with the offsets of its stamps and numbers."""

    def __init__(self) -> None:
        self._chunks = [serialize_message(MarkerArray())[:CDR_HEADER + 4]]
        self._end = CDR_HEADER + 4
        self._blocks: dict[tuple, MarkerBlock] = {}
        self._count = 0
        self._stamps: list[np.ndarray] = []

    def append(self, key: object, prefix: str, make: MakeMarkers) -> np.ndarray:
        """Append a block of markers. Returns the byte offsets of its numbers.

        ``make(prefix)`` returns markers, whose namespaces start with ``prefix``, and their numbers.
        Blocks with equal ``key``, length of prefix and alignment share one call of it.
        """
        start = prefix.encode()
        full_key = key, len(start), self._end % 8
        if full_key not in self._blocks:
            self._blocks[full_key] = MarkerBlock(self._end, *make('x' * len(start)))
        block = self._blocks[full_key]
        begin = self._end + -self._end % 4
        self._chunks += [bytes(begin - self._end), block.with_prefix(start)]
        self._end = begin + len(block.data)
        self._count += block.count
        self._stamps.append(begin + np.array(block.stamps))
        return begin + block.numbers

    def template(self, *numbers: np.ndarray) -> SerializedTemplate:
        """Template of the current array, with its numbers at these byte offsets."""
        self._chunks[0] = self._chunks[0][:CDR_HEADER] + struct.pack('=I', self._count)
        return SerializedTemplate(b''.join(self._chunks), np.concatenate(self._stamps), *numbers)


def append_markers(array: bytes, markers: list[Marker]) -> bytes:
    """A serialized MarkerArray with more markers at its end."""
    if not markers:
        return array
    count, = struct.unpack_from('=I', array, CDR_HEADER)
    return b''.join((array[:CDR_HEADER], struct.pack('=I', count + len(markers)),
                     array[CDR_HEADER + 4:], bytes(-len(array) % 4),
                     serialize_behind(len(array), markers)))


def serialize_behind(end: int, markers: list[Marker]) -> bytes:
    """Bytes of markers that follow ``end`` bytes of a MarkerArray, after padding to four bytes."""
    for text in ('', 'four'):
        before = Marker(text=text)
        begin = len(serialize_message(MarkerArray(markers=[before])))
        begin += -begin % 4
        if (begin - (end + -end % 4)) % 8 == 0:
            break
    return serialize_message(MarkerArray(markers=[before, *markers]))[begin:]
