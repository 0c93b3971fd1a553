"""MCAP of ROS 2 messages, one file per fall, readable by `ros2 bag play` and Foxglove.

/ragdoll/poses is a geometry_msgs/PoseArray of all bones, /ragdoll/joint_states a
sensor_msgs/JointState, /ragdoll/imu/<name>/data_raw a sensor_msgs/Imu, /ragdoll/robot_description a
std_msgs/String with the doll's URDF. The metadata record `fall` holds the phases as frame numbers
and the drawn values. Stamps count from the fall's start.
"""
import io
import json

import numpy as np
from mcap_ros2.writer import Writer

from ...files.urdf import to_urdf
from ..fall import Fall, fall_samples, flaws_of
from ..recipe import Recipe

NAME = 'mcap/fall_{number:07d}.mcap'

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


def shard_files(recipe: Recipe, falls: list[Fall], shard: int) -> dict[str, bytes]:
    """One file per fall."""
    return {NAME.format(number=fall.number): _written(recipe, fall) for fall in falls}


def _written(recipe: Recipe, fall: Fall) -> bytes:
    stream = io.BytesIO()
    samples = [fall_samples(fall, imu).tolist() for imu in range(len(recipe.imus))]
    with Writer(stream) as writer:
        schemas = {kind: writer.register_msgdef(kind, text) for kind, text in DEFINITIONS.items()}

        def write(topic: str, kind: str, frame: float, message: dict) -> None:
            writer.write_message(f'/ragdoll/{topic}', schemas[kind], message,
                                 log_time=_nanoseconds(fall, frame), sequence=int(frame))
        writer.add_metadata('fall', {
            'number': str(fall.number), 'failure': fall.failure,
            'bone_names': json.dumps(fall.scene.bone_names),
            'drawn': json.dumps(fall.drawn, sort_keys=True),
            **{key: '' if frame is None else str(frame)
               for key, frame in vars(fall.phases).items()}})
        write('robot_description', 'std_msgs/msg/String', 0,
              {'data': to_urdf(fall.scene.dolls[0].doll)})
        for frame in range(fall.valid):
            write('poses', 'geometry_msgs/msg/PoseArray', frame, _poses(fall, frame))
            for mount, own in zip(recipe.imus, samples, strict=True):
                many = fall.samples_per_frame
                for place in range(max(0, (frame - 1) * many + 1), frame * many + 1):
                    write(f'imu/{mount["name"]}/data_raw', 'sensor_msgs/msg/Imu',
                          place / many, _imu(fall, place / many, mount, own[place]))
            write('joint_states', 'sensor_msgs/msg/JointState', frame, _joints(fall, frame))
    return stream.getvalue()


def _nanoseconds(fall: Fall, frame: float) -> int:
    return round(frame * fall.times[1] * 1e9)


def _header(fall: Fall, frame: float, frame_id: str) -> dict:
    seconds, rest = divmod(_nanoseconds(fall, frame), 10 ** 9)
    return {'stamp': {'sec': seconds, 'nanosec': rest}, 'frame_id': frame_id}


def _poses(fall: Fall, frame: int) -> dict:
    poses = [{'position': dict(zip('xyz', row[:3], strict=True)),
              'orientation': dict(zip('xyzw', row[3:], strict=True))}
             for row in fall.states[frame, :, :7].tolist()]
    return {'header': _header(fall, frame, 'world'), 'poses': poses}


def _joints(fall: Fall, frame: int) -> dict:
    return {'header': _header(fall, frame, ''), 'name': list(fall.scene.angle_names),
            'position': fall.angles[frame].tolist(), 'velocity': fall.rates[frame].tolist(),
            'effort': []}


def _imu(fall: Fall, frame: float, sensor: dict, sample: list[float]) -> dict:
    """sensor_msgs/Imu by REP 145: orientation not measured, covariance unknown without noise."""
    flaws, unmeasured = flaws_of(sensor), [-1.0] + [0.0] * 8
    return {'header': _header(fall, frame, sensor['name']),
            'orientation': {'x': 0, 'y': 0, 'z': 0, 'w': 1},
            'orientation_covariance': unmeasured,
            'angular_velocity': dict(zip('xyz', sample[3:], strict=True)),
            'angular_velocity_covariance': _covariance(flaws.noise_rate),
            'linear_acceleration': dict(zip('xyz', sample[:3], strict=True)),
            'linear_acceleration_covariance': _covariance(flaws.noise_acceleration)}


def _covariance(deviation: float) -> list[float]:
    return (deviation ** 2 * np.eye(3)).ravel().tolist()
