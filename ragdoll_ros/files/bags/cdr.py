"""CDR encoding of std_msgs/String and geometry_msgs/PoseArray, without ROS.

A message begins with a header of four bytes, whose second byte is odd for little-endian. Numbers
are aligned to their size, counted from the end of the header.
"""
import struct

import numpy as np

from ...model import errors
from ...model.scene import SECOND

STRING, POSE_ARRAY = 'std_msgs/msg/String', 'geometry_msgs/msg/PoseArray'

_POSE_ARRAY_TYPES = (
    ('std_msgs/Header', 'builtin_interfaces/Time stamp\nstring frame_id\n'),
    ('builtin_interfaces/Time', 'int32 sec\nuint32 nanosec\n'),
    ('geometry_msgs/Pose', 'geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n'),
    ('geometry_msgs/Point', 'float64 x\nfloat64 y\nfloat64 z\n'),
    ('geometry_msgs/Quaternion', 'float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n'))

DEFINITIONS = {
    STRING: 'string data',
    POSE_ARRAY: 'std_msgs/Header header\ngeometry_msgs/Pose[] poses\n' + ''.join(
        f'{"=" * 80}\nMSG: {name}\n{fields}' for name, fields in _POSE_ARRAY_TYPES)}
"""Message definitions for MCAP schemas."""

_HEADER = b'\0\1\0\0'


def encode_string(text: str) -> bytes:
    """Encode a String."""
    content = text.encode() + b'\0'
    return _HEADER + struct.pack('<I', len(content)) + content


def decode_string(data: bytes) -> str:
    """Text of a String. Raises Unreadable."""
    try:
        length, = struct.unpack_from(_byte_order(data) + 'I', data, 4)
        return _slice(data, 8, length)[:-1].decode()
    except (struct.error, ValueError, IndexError):
        raise errors.Unreadable('', data[:40], f'{STRING} in CDR') from None


def encode_poses(stamp: int, frame: str, poses: np.ndarray) -> bytes:
    """Encode a PoseArray of poses (n, 7), position m and orientation xyzw; ``stamp`` in ns."""
    name = frame.encode() + b'\0'
    head = struct.pack('<iII', *divmod(stamp, SECOND), len(name)) + name
    head += bytes(-len(head) % 4) + struct.pack('<I', len(poses))
    return _HEADER + head + bytes(-len(head) % 8) + np.ascontiguousarray(poses, '<f8').tobytes()


def decode_poses(data: bytes) -> tuple[int, np.ndarray]:
    """Stamp, ns, and poses (n, 7) of a PoseArray. Raises Unreadable."""
    try:
        order = _byte_order(data)
        seconds, rest, length = struct.unpack_from(order + 'iII', data, 4)
        at = 16 + length + -length % 4
        count, = struct.unpack_from(order + 'I', data, at)
        numbers = np.frombuffer(_slice(data, at + 4 + -at % 8, 56 * count), order + 'f8')
    except (struct.error, ValueError, IndexError):
        raise errors.Unreadable('', data[:40], f'{POSE_ARRAY} in CDR') from None
    return seconds * SECOND + rest, numbers.astype(float).reshape(-1, 7)


def _byte_order(data: bytes) -> str:
    return '<' if data[1] & 1 else '>'


def _slice(data: bytes, start: int, length: int) -> bytes:
    """``length`` bytes of a message. Raises ValueError where it is shorter."""
    if len(data) < start + length:
        raise ValueError(length)
    return data[start:start + length]
