"""Inertial measurement units (IMUs) on bones: samples of angular rate and specific force.

A sample is the mean over its interval: the constant angular rate w and specific force f, in the
sensor's frame, that take orientation and velocity at its start to those at its end. With p = w dt,
G f dt = R0^T (v1 - v0 - g dt), where G is the mean of exp(s p) for s from 0 to 1, the left Jacobian
of SO(3) (Forster et al. 2017, IEEE T-RO 33:1, on preintegration). So the integral of the samples is
the motion. A sample with an impact contains its whole change of velocity: the peak depends on the
sample rate, the sum does not.
"""
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...model import errors, rotation
from ...model.errors import set_fields
from ...model.rotation import IDENTITY
from ...model.state import State
from ...model.vectors import Quaternion, Vector, finite_floats, unit_vector
from ..rigid_body import cross
from .contact_pulse import spread
from .response import ResponseFilter

SMALL = 1e-4
"""rad: below, the second term of the series is less than 1e-9 of the first."""


@dataclass(frozen=True)
class ImuMount:
    """Pose of a sensor in the frame of its bone; ``position`` in m from the centre of mass."""

    bone: str
    position: Vector = (0.0, 0.0, 0.0)
    orientation: Quaternion = IDENTITY

    def __post_init__(self) -> None:
        set_fields(self, position=finite_floats('position', self.position),
                   orientation=unit_vector('orientation', self.orientation, count=4))


@dataclass(frozen=True)
class ImuErrors:
    """Error model of a sensor: white noise, given as the standard deviations of one sample (m/s^2,
    rad/s), a constant ``bias`` (3 m/s^2, 3 rad/s), and saturation at ``range`` (m/s^2, rad/s;
    0: none).
    """

    noise_acceleration: float = 0.0
    noise_rate: float = 0.0
    bias: tuple[float, ...] = (0.0,) * 6
    range: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        set_fields(self, bias=finite_floats('bias', self.bias, 6),
                   range=finite_floats('range', self.range, 2))
        for key, value in (('noise_acceleration', self.noise_acceleration),
                           ('noise_rate', self.noise_rate), ('range', min(self.range))):
            errors.check_range(key, value, 0.0, 1e6)

    def __call__(self, samples: np.ndarray, random: np.random.Generator) -> np.ndarray:
        """Add the errors to true samples (..., 6): specific force, angular rate."""
        spread = np.repeat([self.noise_acceleration, self.noise_rate], 3)
        read = samples + self.bias
        if spread.any():
            read = read + spread * random.standard_normal(read.shape)
        most = np.repeat([size or np.inf for size in self.range], 3)
        return np.clip(read, -most, most)


def sensor_motion(rows: np.ndarray, mount: ImuMount) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions (..., 3) m, orientations (..., 4) and velocities (..., 3) m/s of a sensor, world
    frame, from rows (..., 13) of its bone's State.
    """
    arms = rotation.rotate(rows[..., 3:7], np.array(mount.position))
    return (rows[..., :3] + arms, rotation.multiply(rows[..., 3:7], np.array(mount.orientation)),
            rows[..., 7:10] + cross(rows[..., 10:13], arms))


def imu_samples(rows: np.ndarray, mount: ImuMount, step: float, gravity: Sequence[float],
                response: ResponseFilter | None = None,
                pulses: np.ndarray | None = None) -> np.ndarray:
    """Samples (t, 6) between states of a bone that are ``step`` s apart, rows (t + 1, 13): specific
    force, m/s^2, and angular rate, rad/s, in the sensor's frame (REP 145). ``response`` has the
    state of a soft mount and a low-pass filter; the mount acts on the force alone. ``pulses``
    (t, 2), as of PulseLog, spread the impacts in each sample over time, the force alone.

    The specific force is -gravity at rest and 0 in free fall. Rotations above pi in one sample are
    aliased.
    """
    response = response or ResponseFilter()
    _, turns, velocities = sensor_motion(rows, mount)
    if pulses is not None:
        velocities = spread(velocities, step, np.asarray(gravity, float), pulses)
    velocities = response.mounted(velocities, step, np.asarray(gravity, float))
    turned = rotation.rotation_vector(rotation.multiply(rotation.inverse(turns[:-1]), turns[1:]))
    changed = np.diff(velocities, axis=0) / step - np.asarray(gravity, float)
    force = _from_mean(turned, rotation.rotate(rotation.inverse(turns[:-1]), changed))
    return response.low_pass(np.concatenate([force, turned / step], axis=1), step)


def tick_samples(substates: Sequence[State], bone: int, mount: ImuMount, step: float,
                 gravity: Sequence[float], response: ResponseFilter | None = None) -> np.ndarray:
    """Samples (t, 6) of the last tick, of ``step`` s, from Simulation.substates and the bone's
    index in the scene.
    """
    rows = np.array([state.rows[bone] for state in substates])
    return imu_samples(rows, mount, step / max(len(rows) - 1, 1), gravity, response)


def _from_mean(turned: np.ndarray, mean: np.ndarray) -> np.ndarray:
    """Solve G f = ``mean`` (t, 3) for f, with p = ``turned`` (t, 3) rad:
    G^-1 = 1 - [p]/2 + c [p]^2, c = (1 - (|p|/2) cot(|p|/2)) / |p|^2.
    """
    size = np.linalg.norm(turned, axis=-1, keepdims=True)
    some = np.where(size > SMALL, size, 1.0)
    factor = np.where(size > SMALL, (1 - some / 2 / np.tan(some / 2)) / some ** 2, 1 / 12)
    across = cross(turned, mean)
    return mean - across / 2 + factor * cross(turned, across)
