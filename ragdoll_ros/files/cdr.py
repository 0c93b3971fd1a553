"""ROS messages as bytes, without ROS: String and PoseArray in CDR.

CDR begins with four bytes, of which the second is odd where numbers are little-endian; from their
end on, a number stands at a multiple of its size.
"""
from __future__ import annotations

import struct

import numpy as np

from ..model import errors
from ..model.scene import SECOND

STRING, POSE_ARRAY = 'std_msgs/msg/String', 'geometry_msgs/msg/PoseArray'

_BETWEEN = '=' * 80

DEFINITIONS = {STRING: 'string data', POSE_ARRAY: f"""std_msgs/Header header
geometry_msgs/Pose[] poses
{_BETWEEN}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{_BETWEEN}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
{_BETWEEN}
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
{_BETWEEN}
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
{_BETWEEN}
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
"""}
"""What a recording must tell of its messages, so that others can read them."""

_HEAD = b'\0\1\0\0'


def encode_string(text: str) -> bytes:
    """A String."""
    content = text.encode() + b'\0'
    return _HEAD + struct.pack('<I', len(content)) + content


def decode_string(data: bytes) -> str:
    """What a String holds; Unreadable where that is none."""
    try:
        length, = struct.unpack_from(_order(data) + 'I', data, 4)
        return _part(data, 8, length)[:-1].decode()
    except (struct.error, ValueError, IndexError):
        raise errors.Unreadable('', data[:40], f'{STRING} in CDR') from None


def encode_poses(stamp: int, frame: str, poses: np.ndarray) -> bytes:
    """A PoseArray of poses (n, 7), position m and orientation x, y, z, w; ``stamp`` in ns."""
    name = frame.encode() + b'\0'
    head = struct.pack('<iII', *divmod(stamp, SECOND), len(name)) + name
    head += bytes(-len(head) % 4) + struct.pack('<I', len(poses))
    return _HEAD + head + bytes(-len(head) % 8) + np.ascontiguousarray(poses, '<f8').tobytes()


def decode_poses(data: bytes) -> tuple[int, np.ndarray]:
    """Stamp, ns, and poses (n, 7) of a PoseArray; Unreadable where that is none."""
    try:
        order = _order(data)
        seconds, rest, length = struct.unpack_from(order + 'iII', data, 4)
        at = 16 + length + -length % 4
        count, = struct.unpack_from(order + 'I', data, at)
        numbers = np.frombuffer(_part(data, at + 4 + -at % 8, 56 * count), order + 'f8')
    except (struct.error, ValueError, IndexError):
        raise errors.Unreadable('', data[:40], f'{POSE_ARRAY} in CDR') from None
    return seconds * SECOND + rest, numbers.astype(float).reshape(-1, 7)


def _order(data: bytes) -> str:
    return '<' if data[1] & 1 else '>'


def _part(data: bytes, start: int, length: int) -> bytes:
    """Bytes of a message that must be there."""
    if len(data) < start + length:
        raise ValueError(length)
    return data[start:start + length]
