"""Definitions of the ROS 2 messages that are written without a ROS (common_interfaces, Jazzy)."""
from __future__ import annotations

_PARTS = {
    'builtin_interfaces/Time': 'int32 sec\nuint32 nanosec\n',
    'std_msgs/Header': 'builtin_interfaces/Time stamp\nstring frame_id\n',
    'geometry_msgs/Point': 'float64 x\nfloat64 y\nfloat64 z\n',
    'geometry_msgs/Vector3': 'float64 x\nfloat64 y\nfloat64 z\n',
    'geometry_msgs/Quaternion': 'float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n',
    'geometry_msgs/Pose': 'geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n'}
_HEADER = ('std_msgs/Header', 'builtin_interfaces/Time')


def _with_parts(text: str, *parts: str) -> str:
    return ''.join([text, *(f'{"=" * 80}\nMSG: {part}\n{_PARTS[part]}' for part in parts)])


DEFINITIONS = {
    'std_msgs/msg/String': 'string data\n',
    'geometry_msgs/msg/PoseArray': _with_parts(
        'std_msgs/Header header\ngeometry_msgs/Pose[] poses\n', *_HEADER, 'geometry_msgs/Pose',
        'geometry_msgs/Point', 'geometry_msgs/Quaternion'),
    'sensor_msgs/msg/JointState': _with_parts(
        'std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n'
        'float64[] effort\n', *_HEADER),
    'sensor_msgs/msg/Imu': _with_parts(
        'std_msgs/Header header\ngeometry_msgs/Quaternion orientation\n'
        'float64[9] orientation_covariance\ngeometry_msgs/Vector3 angular_velocity\n'
        'float64[9] angular_velocity_covariance\ngeometry_msgs/Vector3 linear_acceleration\n'
        'float64[9] linear_acceleration_covariance\n', *_HEADER, 'geometry_msgs/Quaternion',
        'geometry_msgs/Vector3')}
"""Text of each, with the definitions of its parts, as MCAP's encoding ros2msg has it."""
