"""A MarkerArray put together from serialized pieces, of which equal dolls share one.

Where a number stands in a serialized marker depends on where that begins, modulo eight. So a piece
is serialized behind a marker that ends, so seen, where the piece is to go.
"""
from __future__ import annotations

import struct
from collections.abc import Callable

import numpy as np
from rclpy.serialization import serialize_message
from visualization_msgs.msg import Marker, MarkerArray

from ...model.scene import SECOND
from .serialized import HEAD, STAMP_MARK, Form

STAMP = struct.pack('=iI', *divmod(STAMP_MARK, SECOND))

Make = Callable[[str], tuple[list[Marker], np.ndarray]]


class Piece:
    """Markers as they are serialized behind ``end`` bytes of a MarkerArray.

    Each has the stamp STAMP_MARK, and its row of ``numbers`` (markers, k) from some place on.
    ``stamps``, ``names`` and ``numbers`` are places in ``data``, in bytes: of each marker's stamp,
    of its namespace, and of each number, row by row.
    """

    def __init__(self, end: int, markers: list[Marker], numbers: np.ndarray) -> None:
        self.data, self.count = following(end, markers), len(markers)
        self.stamps, self.names, rows, at = [], [], [], 0
        for marker, row in zip(markers, numbers, strict=True):
            self.stamps.append(self.data.index(STAMP, at))
            name = marker.ns.encode() + b'\0'
            at = self.data.index(struct.pack('=I', len(name)) + name, self.stamps[-1]) + 4
            self.names.append(at)
            rows.append(self.data.index(row.tobytes(), at))
        self.numbers = (np.array(rows)[:, None] + 8 * np.arange(numbers.shape[1])).ravel()

    def named(self, name: bytes) -> bytes:
        """The data, with this at the beginning of each namespace."""
        data = bytearray(self.data)
        for at in self.names:
            data[at:at + len(name)] = name
        return bytes(data)


class MarkerList:
    """A serialized MarkerArray that grows, and the places of its stamps and numbers."""

    def __init__(self) -> None:
        self._pieces = [serialize_message(MarkerArray())[:HEAD + 4]]
        self._end = HEAD + 4
        self._made: dict[tuple, Piece] = {}
        self._count = 0
        self._stamps: list[np.ndarray] = []

    def append(self, kind: object, name: str, make: Make) -> np.ndarray:
        """Append the markers of a kind, as of one named so; places of their numbers, in bytes.

        ``make`` gives markers, whose namespaces begin with the name that it is given, and their
        numbers. It is called for the first of a kind; for another, unless its name is of another
        length, a copy of the bytes will do.
        """
        owner = name.encode()
        key = kind, len(owner), self._end % 8
        if key not in self._made:
            self._made[key] = Piece(self._end, *make('x' * len(owner)))
        piece = self._made[key]
        begin = self._end + -self._end % 4
        self._pieces += [bytes(begin - self._end), piece.named(owner)]
        self._end = begin + len(piece.data)
        self._count += piece.count
        self._stamps.append(begin + np.array(piece.stamps))
        return begin + piece.numbers

    def form(self, *numbers: np.ndarray) -> Form:
        """The form of the array as it is now, its numbers to be set at these places."""
        self._pieces[0] = self._pieces[0][:HEAD] + struct.pack('=I', self._count)
        return Form(b''.join(self._pieces), np.concatenate(self._stamps), *numbers)


def joined(array: bytes, more: list[Marker]) -> bytes:
    """A serialized MarkerArray with more markers at its end."""
    if not more:
        return array
    count, = struct.unpack_from('=I', array, HEAD)
    return b''.join((array[:HEAD], struct.pack('=I', count + len(more)), array[HEAD + 4:],
                     bytes(-len(array) % 4), following(len(array), more)))


def following(end: int, markers: list[Marker]) -> bytes:
    """Bytes of markers in a MarkerArray behind ``end`` bytes, from the next multiple of four on."""
    for text in ('', 'four'):
        before = Marker(text=text)
        begin = len(serialize_message(MarkerArray(markers=[before])))
        begin += -begin % 4
        if (begin - (end + -end % 4)) % 8 == 0:
            break
    return serialize_message(MarkerArray(markers=[before, *markers]))[begin:]
