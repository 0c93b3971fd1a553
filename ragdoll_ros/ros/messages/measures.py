"""~/measures as bytes: simulated time, run and energy of each tick, in a DiagnosticArray.

rclpy takes 0.1 ms to serialize such a message and as long to read it; this takes a tenth of that.
Little-endian CDR (OMG DDS-XTypes 1.2, 7.4.1): strings have their length before and a zero behind
them, and begin at multiples of four bytes from the end of the header.
"""
from __future__ import annotations

import struct
import zlib
from functools import lru_cache
from typing import NamedTuple

from ...model.scene import SECOND

CDR_HEADER = b'\0\1\0\0'

RUN, URDF, SCENE = 'run', 'urdf_crc32', 'scene_crc32'
TIME, EXCESS = 'simulated_time', 'energy_excess_J'
WORK_OF_PUSHES, WORK_OF_GRABS = 'work_of_pushes_J', 'work_of_grabs_J'


class TickMeasures(NamedTuple):
    """What ~/measures holds for the state with the same stamp."""

    time: int
    """Simulated time since the run's start, ns."""
    run: int
    """Number of the run, another one after each reset, change of scene and start of a node."""
    urdf: str
    """Checksum of the scene's URDF; see `checksum`."""
    scene: str
    """Checksum of the text on ~/scene; empty where that is not published."""
    energy_excess: float
    """Energy of all dolls, J, minus that at the start and all work."""
    work_of_pushes: float
    work_of_grabs: float


def checksum(text: str) -> str:
    """CRC-32 of a text as eight hexadecimal digits: tells which scene a message belongs to."""
    return f'{zlib.crc32(text.encode()):08x}'


def serialize_measures(name: str, stamp: int, measures: TickMeasures) -> bytes:
    """Serialized DiagnosticArray with one status of this ``name``; ``stamp`` in ns."""
    seconds, rest = divmod(measures.time, SECOND)
    texts = (f'{seconds}.{rest:09}', f'{measures.energy_excess:.9g}',
             f'{measures.work_of_pushes:.9g}', f'{measures.work_of_grabs:.9g}')
    return b''.join((CDR_HEADER, struct.pack('<iI', *divmod(stamp, SECOND)),
                     _status(name, measures.run, measures.urdf, measures.scene),
                     *(key + _padded(text) for key, text in zip(_KEYS, texts, strict=True))))


_ENDS = tuple(bytes(4 - length % 4) for length in range(4))
"""Zeros behind a string by its length modulo four."""


def _padded(text: str) -> bytes:
    """Serialize a string that begins at a multiple of four bytes, and pad it to the next."""
    content = text.encode()
    return (len(content) + 1).to_bytes(4, 'little') + content + _ENDS[len(content) % 4]


_KEYS = tuple(map(_padded, (TIME, EXCESS, WORK_OF_PUSHES, WORK_OF_GRABS)))
"""Of what changes from tick to tick."""


@lru_cache(1)
def _status(name: str, run: int, urdf: str, scene: str) -> bytes:
    """Serialize all between the stamp and what changes from tick to tick: the frame, one status of
    level 0, the number of values, and the values that are constant in a run.
    """
    constant = {RUN: str(run), URDF: urdf, SCENE: scene}
    return b''.join((_padded(''), struct.pack('<IB3x', 1, 0), _padded(name), _padded(''),
                     _padded(''), struct.pack('<I', len(constant) + len(_KEYS)),
                     *(_padded(text) for pair in constant.items() for text in pair)))


def deserialize_measures(data: bytes) -> tuple[int, TickMeasures]:
    """Stamp, ns, and measures of a serialized message of ~/measures; ValueError for other data."""
    try:
        if data[:2] != CDR_HEADER[:2]:
            raise ValueError('not little-endian')
        seconds, nanoseconds = struct.unpack_from('<iI', data, 4)
        _, at = _string(data, 12)
        # The count of statuses, and the level of the first.
        at += -at % 4 + 5
        for _ in range(3):
            _, at = _string(data, at)
        at += -at % 4
        count, = struct.unpack_from('<I', data, at)
        texts, at = [], at + 4
        for _ in range(2 * min(count, len(data))):
            text, at = _string(data, at)
            texts.append(text)
        values = dict(zip(texts[::2], texts[1::2], strict=True))
        whole, _, part = values[TIME].partition('.')
        return seconds * SECOND + nanoseconds, TickMeasures(
            int(whole) * SECOND + int(part), int(values[RUN]), values[URDF], values[SCENE],
            float(values[EXCESS]), float(values[WORK_OF_PUSHES]), float(values[WORK_OF_GRABS]))
    except (struct.error, IndexError, KeyError) as error:
        raise ValueError(str(error)) from None


def _string(data: bytes, at: int) -> tuple[str, int]:
    """The string at the next multiple of four bytes, and where it ends."""
    at += -at % 4
    length, = struct.unpack_from('<I', data, at)
    end = at + 4 + length
    if not length or end > len(data):
        raise ValueError('a string does not end in the message')
    return data[at + 4:end - 1].decode(), end
