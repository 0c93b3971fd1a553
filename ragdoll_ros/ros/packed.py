"""A message kept in its serialized form, its numbers overwritten in place.

Converting a PoseArray of 1 000 poses takes rclpy 5 ms a message; copying 56 000 bytes takes 8 µs.
"""
from __future__ import annotations

import struct
from collections.abc import Callable

import numpy as np
from rclpy.serialization import serialize_message

_STAMP_MARK = 0x5A5B5C5D * 1_000_000_000 + 0x1A2B3C4D


class Packed:
    """Bytes of a message with a header's stamp and blocks of float64.

    ``make`` builds the message in the plain way from a stamp (ns) and one array for each of
    ``shapes``. It is called once, with numbers that occur nowhere else; where they turn up in
    the serialized message, the numbers of every later message go. Nothing is assumed of the
    form but that a block is contiguous, as CDR has it; a ValueError says if it is not.
    """

    def __init__(self, make: Callable, *shapes: tuple[int, ...]) -> None:
        marks, used = [], 1
        for shape in shapes:
            size = int(np.prod(shape))
            marks.append((np.arange(used, used + size) * np.pi).reshape(shape))
            used += size
        self._bytes = bytearray(serialize_message(make(_STAMP_MARK, *marks)))
        self._stamp = self._bytes.index(_stamp(_STAMP_MARK))
        self._blocks = [np.ndarray(mark.shape, float, self._bytes,
                                   self._bytes.index(mark.tobytes())) for mark in marks]

    def message(self, stamp: int, *values: np.ndarray) -> bytes:
        """Serialized message with this stamp, ns, and these numbers."""
        self._bytes[self._stamp:self._stamp + 8] = _stamp(stamp)
        for block, value in zip(self._blocks, values, strict=True):
            block[...] = value
        return bytes(self._bytes)


def poses_in(data: bytes) -> tuple[int, np.ndarray]:
    """Stamp (ns) and poses (n, 7) of a serialized PoseArray; ValueError if it is none.

    Little-endian CDR (OMG's DDS-XTypes 1.2, 7.4.1): four bytes of head, then the stamp, the
    frame's name, the count, and float64 at multiples of eight, counted from behind the head.
    """
    try:
        if data[1] != 1:
            raise ValueError('not little-endian')
        seconds, rest, length = struct.unpack_from('<iII', data, 4)
        at = 16 + length + -length % 4
        count, = struct.unpack_from('<I', data, at)
        at += 4 + -at % 8
        poses = np.frombuffer(data, '<f8', 7 * count, at if count else 0).reshape(-1, 7)
    except (struct.error, IndexError) as error:
        raise ValueError(str(error)) from None
    return seconds * 1_000_000_000 + rest, poses


def _stamp(nanoseconds: int) -> bytes:
    return struct.pack('=iI', *divmod(nanoseconds, 1_000_000_000))
