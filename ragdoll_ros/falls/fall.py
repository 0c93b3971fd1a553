"""One fall: its start, frames, phases, impacts, and the samples of its inertial sensors."""
import math
from dataclasses import dataclass, field, fields
from functools import cached_property

import numpy as np

from ..model import rotation
from ..model.scene import Scene
from ..people.fall_phases import Phases, bone_impacts
from ..physics.sensors.impacts import Impact
from ..physics.sensors.imu import ImuErrors, ImuMount, imu_samples, sensor_motion
from ..physics.sensors.response import ImuResponse, ResponseFilter
from .worst_impacts import WorstImpacts

SAMPLE_NAMES = ('ax', 'ay', 'az', 'wx', 'wy', 'wz')


@dataclass(frozen=True)
class Fall:
    """Fall ``number`` of a recipe: t frames of n bones and k joint angles, world frame, SI units.

    If the simulation failed, ``failure`` says why. From the failure on, ``states``, ``angles``,
    ``rates`` and ``imu_states`` are NaN, and ``touching`` is False.
    """

    number: int
    drawn: dict
    """Values drawn for it, as returned by Recipe.draw."""
    scene: Scene
    """The simulated scene; its order of bones and of joint angles is that of all arrays."""
    times: np.ndarray
    """(t,) s from the start."""
    states: np.ndarray
    """(t, n, 13) as State.rows: position m, orientation xyzw, velocity m/s, rad/s of each bone."""
    angles: np.ndarray
    """(t, k) rad, in the order of Scene.angle_names."""
    rates: np.ndarray
    """(t, k) rad/s."""
    touching: np.ndarray
    """(t, n) whether each bone touches the ground, or has since the frame before."""
    imus: list[dict]
    """The recipe's w inertial sensors."""
    samples_per_frame: int
    """Sensor samples in each frame."""
    imu_states: np.ndarray
    """((t - 1) samples_per_frame + 1, w, 13) as ``states``: sensors' bones at each sample."""
    valid: int
    """Number of frames before a failure; all of them if there was none."""
    failure: str
    phases: Phases
    energy_excess: float
    """Energy gain that no work accounts for, J, at the last valid frame; losses are negative."""
    noise_key: int = 0
    """128-bit key of the random generator (Philox) of the sensor noise."""
    worst_impacts: WorstImpacts = field(default_factory=lambda: WorstImpacts({}))
    """Of each region of the body, by the limits of load_limits()."""
    contacts: tuple[Impact, ...] = ()
    """Each impact of a bone, by time, once: of two bones that meet, that of the first."""
    feet: tuple[str, ...] = ()
    """Bones that may touch the ground before the impact."""
    pulses: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    """((t - 1) samples_per_frame, 2) s: how long after a sample the pulse of its impacts begins,
    and how long it lasts, of the samples after the first; 0 where there is none."""

    @property
    def masses(self) -> np.ndarray:
        """(n,) kg."""
        return np.array([bone.mass for bone in self.scene.bones])

    @property
    def direction(self) -> float:
        """Direction of the centre of mass from the start to first contact, degrees in [-180, 180).

        Relative to the doll's heading at the start: 0 forwards, 90 to its left; NaN if the fall has
        no impact. If the doll has ``feet`` and moves horizontally at the start, the direction is
        that from the middle of the feet to the centre of mass at first contact, because a walking
        doll moves forwards, whatever the direction of its fall.
        """
        if self.phases.impact is None:
            return math.nan
        ends = self.states[[0, self.phases.impact], :, :2]
        x, y = np.diff(np.einsum('tnk,n->tk', ends, self.masses), axis=0)[0]
        if self.feet and any(self.scene.dolls[0].velocity[:2]):
            feet = ends[1, [self.scene.bone_index(name) for name in self.feet]].mean(axis=0)
            x, y = self.masses @ ends[1] / self.masses.sum() - feet
        faced = rotation.rotate(self.scene.dolls[0].orientation, (1.0, 0.0, 0.0))
        turned = math.degrees(math.atan2(y, x) - math.atan2(faced[1], faced[0]))
        return (turned + 180) % 360 - 180

    @property
    def impact_frames(self) -> np.ndarray:
        """(n,) frame in which each bone first touches the ground; NaN if it never does, or does at
        the start.
        """
        return self._impacts[0]

    @property
    def impact_velocities(self) -> np.ndarray:
        """(n, 3) m/s of the centres of mass, in the frame before impact_frames."""
        return self._impacts[1]

    @cached_property
    def _impacts(self) -> tuple[np.ndarray, np.ndarray]:
        return bone_impacts(self.states[:self.valid], self.touching[:self.valid])


def fall_samples(fall: Fall, imu: int) -> np.ndarray:
    """Samples (s, 6) of the recipe's sensor ``imu``, m/s^2 and rad/s in its own axes, with its
    response, noise, bias and range.

    Sample k is the mean over the interval that ends at its stamp; the first repeats the second.
    """
    true = imu_samples(fall.imu_states[:, imu], mount_of(fall, imu),
                       fall.times[1] / fall.samples_per_frame, fall.scene.gravity,
                       ResponseFilter(response_of(fall.imus[imu])),
                       fall.pulses if fall.imus[imu].get('contact_pulse') else None)
    # Recipe.draw's counter begins with 0, a sensor's with 1 + imu: they are 2^128 draws apart.
    random = np.random.Generator(np.random.Philox(
        key=fall.noise_key, counter=[0, 0, 1 + imu, fall.number]))
    samples = flaws_of(fall.imus[imu])(true, random)
    return np.concatenate([samples[:1], samples])


def samples_by_frame(fall: Fall, imu: int) -> np.ndarray:
    """The samples of fall_samples() by frame, (t, samples_per_frame, 6): those after the frame
    before, up to the frame's instant.

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
    return ImuErrors(**_named(ImuErrors, sensor))


def response_of(sensor: dict) -> ImuResponse:
    """Soft mount and low-pass filter of a recipe's sensor; OutOfRange."""
    return ImuResponse(**_named(ImuResponse, sensor))


def _named(kind: type, sensor: dict) -> dict:
    """Values that a recipe's sensor gives for the fields of the dataclass ``kind``, by name."""
    return {field.name: sensor[field.name] for field in fields(kind) if field.name in sensor}


def mount_of(fall: Fall, imu: int) -> ImuMount:
    """Bone, position and orientation of the sensor."""
    return ImuMount(**{key: fall.imus[imu][key] for key in ('bone', 'position', 'orientation')})
