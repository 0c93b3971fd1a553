"""Samples of the inertial sensors of a fall, as defined in physics/sensors/imu.py."""
from __future__ import annotations

from dataclasses import fields

import numpy as np

from ..physics.sensors.imu import ImuErrors, ImuMount, imu_samples, sensor_motion
from .fall import Fall

NAMES = ('ax', 'ay', 'az', 'wx', 'wy', 'wz')


def fall_samples(fall: Fall, imu: int) -> np.ndarray:
    """Samples (s, 6) of the recipe's sensor ``imu``, m/s^2 and rad/s in its own axes, with noise,
    bias and range.

    Sample k is the mean over the interval that ends at its stamp; the first repeats the second.
    """
    true = imu_samples(fall.imu_states[:, imu], mount_of(fall, imu),
                       fall.times[1] / fall.samples_per_frame, fall.scene.gravity)
    # Recipe.draw's counter begins with 0, a sensor's with 1 + imu: they are 2^128 draws apart.
    random = np.random.Generator(np.random.Philox(
        key=fall.noise_key, counter=[0, 0, 1 + imu, fall.number]))
    samples = flaws_of(fall.imus[imu])(true, random)
    return np.concatenate([samples[:1], samples])


def samples_by_frame(fall: Fall, imu: int) -> np.ndarray:
    """The same samples by frame, (t, samples_per_frame, 6): those up to the frame's instant.

    All samples of the first frame are equal.
    """
    samples = fall_samples(fall, imu)
    first = np.repeat(samples[:1], fall.samples_per_frame - 1, axis=0)
    return np.concatenate([first, samples]).reshape(-1, fall.samples_per_frame, 6)


def sensor_orientations(fall: Fall, imu: int) -> np.ndarray:
    """Orientations (s, 4) of the sensor in the world at the sample times."""
    return sensor_motion(fall.imu_states[:, imu], mount_of(fall, imu))[1]


def flaws_of(sensor: dict) -> ImuErrors:
    """Noise, bias and range of a recipe's sensor; NotFinite, OutOfRange."""
    return ImuErrors(**{field.name: sensor[field.name] for field in fields(ImuErrors)
                        if field.name in sensor})


def mount_of(fall: Fall, imu: int) -> ImuMount:
    """Bone, position and orientation of the sensor."""
    return ImuMount(**{key: fall.imus[imu][key] for key in ('bone', 'position', 'orientation')})
