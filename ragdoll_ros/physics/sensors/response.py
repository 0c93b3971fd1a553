"""What stands between a bone and the samples of a sensor on it: soft tissue, and the chip's filter.

The mount is a mass on an isotropic spring and damper, on a point of the bone. Its deflection u, in
world axes, follows u'' = -w^2 u - 2 z w u' - f, w = 2 pi frequency, z the damping ratio and f the
bone's specific force at that point; the sensor's velocity is the point's plus u'. The filter is
y'' = w^2 (x - y) - sqrt(2) w y', Butterworth's of order 2, w = 2 pi bandwidth, x a sample in the
sensor's axes. f and x are constant from one sample to the next; both equations are then solved
exactly.
"""
from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np

from ...model import errors

RANGES = {'mount_frequency': (0.0, 1000.0), 'mount_damping': (0.0, 10.0),
          'bandwidth': (0.0, 1000.0)}


@dataclass(frozen=True)
class ImuResponse:
    """Response of a sensor: ``mount_frequency`` Hz, natural frequency of the sensor on the tissue
    below it (0: rigid), ``mount_damping``, damping ratio of that, and ``bandwidth`` Hz, -3 dB
    frequency of the chip's low-pass filter of order 2 (0: none). Raises NotFinite, OutOfRange.
    """

    mount_frequency: float = 0.0
    mount_damping: float = 0.3
    bandwidth: float = 0.0

    def __post_init__(self) -> None:
        for field in fields(self):
            errors.check_range(field.name, getattr(self, field.name), *RANGES[field.name])


class ResponseFilter:
    """Applies a response to successive samples of one sensor, and keeps its state between calls.

    It starts in equilibrium: the first sample is the bone's.
    """

    def __init__(self, response: ImuResponse = ImuResponse()) -> None:
        self._response = response
        self._mount: Oscillators | None = None
        self._chip: Oscillators | None = None

    def mounted(self, velocities: np.ndarray, step: float, gravity: np.ndarray) -> np.ndarray:
        """Velocities (t + 1, 3) m/s of the sensor, world frame, from those of its point on the
        bone, ``step`` s apart.
        """
        response = self._response
        if not response.mount_frequency or len(velocities) < 2:
            return velocities
        forces = gravity - np.diff(velocities, axis=0) / step
        self._mount = self._mount or Oscillators(response.mount_frequency, response.mount_damping,
                                                 forces[0])
        before = self._mount.rate.copy()
        _, rates = self._mount.drive(forces, step)
        return velocities + np.concatenate([before[None], rates])

    def low_pass(self, samples: np.ndarray, step: float) -> np.ndarray:
        """Samples (t, 6), ``step`` s apart, after the chip's filter."""
        bandwidth = self._response.bandwidth
        if not bandwidth or not len(samples):
            return samples
        forces = (2 * math.pi * bandwidth) ** 2 * samples
        self._chip = self._chip or Oscillators(bandwidth, math.sqrt(0.5), forces[0])
        return self._chip.drive(forces, step)[0]


class Oscillators:
    """Equal oscillators z'' = -w^2 z - 2 damping w z' + force, first in equilibrium with forces
    (k,); w = 2 pi ``frequency``, Hz.
    """

    def __init__(self, frequency: float, damping: float, forces: np.ndarray) -> None:
        # Imported where it is needed: settings are read by programs that drive nothing.
        from ..kernels.swing.loaded import oscillator
        w = 2 * math.pi * frequency
        self._advance = oscillator.drive_oscillators
        self._stiffness, self._damping = w ** 2, 2 * damping * w
        self.z, self.rate = forces / w ** 2, np.zeros(len(forces))

    def drive(self, forces: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
        """Values z and z' (t, k) at the ends of steps in which forces (t, k) are constant."""
        z, rate = np.empty((2, *forces.shape))
        self._advance(self._stiffness, self._damping, step, np.ascontiguousarray(forces), self.z,
                      self.rate, z, rate)
        return z, rate
