"""What inertial sensors that are worn on bones read in a fall, as `physics.imu` tells."""
from __future__ import annotations

from dataclasses import fields

import numpy as np

from ..physics.sensors.imu import ImuErrors, ImuMount, imu_samples, sensor_motion
from .fall import Fall

NAMES = ('ax', 'ay', 'az', 'wx', 'wy', 'wz')


def worn_samples(fall: Fall, imu: int) -> np.ndarray:
    """Samples (s, 6) of the recipe's sensor ``imu``, m/s^2 and rad/s in its own axes, with its
    flaws: each is of the time up to its instant. The first, before which nothing was, is the
    second's.
    """
    true = imu_samples(fall.worn[:, imu], mounted(fall, imu), fall.times[1] / fall.parts,
                       fall.scene.gravity)
    # Recipe.draw's counter begins with 0 where a sensor's does with 1 + imu, 2^128 numbers apart.
    random = np.random.Generator(np.random.Philox(
        key=fall.noise_key, counter=[0, 0, 1 + imu, fall.number]))
    samples = flaws_of(fall.imus[imu])(true, random)
    return np.concatenate([samples[:1], samples])


def by_frames(fall: Fall, imu: int) -> np.ndarray:
    """The same samples, those of each frame (t, parts, 6) up to its instant; the first frame's are
    all the same.
    """
    samples = worn_samples(fall, imu)
    first = np.repeat(samples[:1], fall.parts - 1, axis=0)
    return np.concatenate([first, samples]).reshape(-1, fall.parts, 6)


def worn_orientations(fall: Fall, imu: int) -> np.ndarray:
    """Orientations (s, 4) of the sensor in the world at the same instants."""
    return sensor_motion(fall.worn[:, imu], mounted(fall, imu))[1]


def flaws_of(sensor: dict) -> ImuErrors:
    """What a recipe's sensor adds to what it should read; NotFinite, OutOfRange."""
    return ImuErrors(**{field.name: sensor[field.name] for field in fields(ImuErrors)
                    if field.name in sensor})


def mounted(fall: Fall, imu: int) -> ImuMount:
    """Where the sensor is worn."""
    return ImuMount(**{key: fall.imus[imu][key] for key in ('bone', 'position', 'orientation')})
