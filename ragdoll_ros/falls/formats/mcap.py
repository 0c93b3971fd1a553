"""MCAP of ROS 2 messages, one file per fall, readable by `ros2 bag play` and Foxglove.

/ragdoll/poses is a geometry_msgs/PoseArray of all bones, /ragdoll/joint_states a
sensor_msgs/JointState, /ragdoll/imu/<name>/data_raw a sensor_msgs/Imu, /ragdoll/robot_description a
std_msgs/String with the doll's URDF. The metadata record `fall` holds the phases as frame numbers
and the drawn values. Stamps count from the fall's start.
"""
from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np
from mcap_ros2.writer import Writer

from ...files.urdf import to_urdf
from ..fall import Fall
from ..imu_samples import fall_samples, flaws_of
from ..recipe import Recipe
from .definitions import DEFINITIONS

NAME = 'mcap/fall_{number:07d}.mcap'


def shard_files(recipe: Recipe, falls: list[Fall], shard: int) -> dict[str, bytes]:
    """One file per fall."""
    return {NAME.format(number=fall.number): _written(recipe, fall) for fall in falls}


def last_files(recipe: Recipe, count: int, folder: Path) -> dict[str, bytes]:
    """None: each file is complete."""
    return {}


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
