"""What inertial sensors that are worn on bones would read, from a fall's frames.

Each sample is the mean over the frame before it, as of a sensor that averages between samples: the
specific force from what the sensor's velocity changed by, the angular rate from what it was turned
by. An impact gives so the momentum that it took, whatever its own short course.
"""
from __future__ import annotations

import numpy as np

from ..model import rotation
from .fall import Fall

NAMES = ('ax', 'ay', 'az', 'wx', 'wy', 'wz')


def imu_samples(fall: Fall, mount: dict) -> np.ndarray:
    """Samples (t, 6): specific force m/s^2 and angular rate rad/s, in the sensor's axes.

    ``mount`` is one of a recipe's record.imus: ``position`` m from the bone's centre of mass and
    ``orientation`` x, y, z, w are along the bone's own axes. At rest, axes upright, it reads
    (0, 0, 9.8, 0, 0, 0) (REP 145). The first sample is the second's.
    """
    step = fall.times[1] - fall.times[0]
    turns, velocities = _motion(fall, mount)
    gravity = np.array(fall.scene.gravity)
    force = np.diff(velocities, axis=0) / step - gravity
    turned = rotation.rotation_vector(rotation.multiply(rotation.inverse(turns[:-1]), turns[1:]))
    middle = rotation.multiply(turns[:-1], rotation.from_rotation_vector(turned / 2))
    samples = np.concatenate([rotation.rotate(rotation.inverse(middle), force), turned / step],
                             axis=1)
    return np.concatenate([samples[:1], samples])


def sensor_orientations(fall: Fall, mount: dict) -> np.ndarray:
    """Orientations (t, 4) of the sensor in the world."""
    return _motion(fall, mount)[0]


def _motion(fall: Fall, mount: dict) -> tuple[np.ndarray, np.ndarray]:
    """Orientations (t, 4) and velocities (t, 3) m/s of the sensor in the world."""
    rows = fall.states[:, fall.scene.bone_index(mount['bone'])]
    arms = rotation.rotate(rows[:, 3:7], np.array(mount['position'], float))
    return (rotation.multiply(rows[:, 3:7], np.array(mount['orientation'], float)),
            rows[:, 7:10] + np.cross(rows[:, 10:13], arms))
