"""One fall: its start, its frames, its phases and its impacts."""
from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..model import rotation
from ..model.scene import Scene
from ..people.fall_phases import Phases, bone_impacts


@dataclass(frozen=True)
class Fall:
    """Fall ``number`` of a recipe, t frames of n bones and k joint angles, world frame, SI units.

    If the simulation failed, frames from the failure on hold NaN, and ``failure`` says why.
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
    """(t, n) whether each bone touches the ground."""
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

    @property
    def masses(self) -> np.ndarray:
        """(n,) kg."""
        return np.array([bone.mass for bone in self.scene.bones])

    @property
    def direction(self) -> float:
        """Direction of the centre of mass from the start to first contact, degrees in [-180, 180).

        Relative to the doll's heading at the start: 0 forwards, 90 to its left; NaN if the fall
        has no impact.
        """
        if self.phases.impact is None:
            return math.nan
        ends = self.states[[0, self.phases.impact], :, :2]
        x, y = np.diff(np.einsum('tnk,n->tk', ends, self.masses), axis=0)[0]
        faced = rotation.rotate(self.scene.dolls[0].orientation, (1.0, 0.0, 0.0))
        turned = math.degrees(math.atan2(y, x) - math.atan2(faced[1], faced[0]))
        return (turned + 180) % 360 - 180

    @property
    def impact_frames(self) -> np.ndarray:
        """(n,) frame in which each bone first touches the ground; NaN if never or at once."""
        return self._impacts[0]

    @property
    def impact_velocities(self) -> np.ndarray:
        """(n, 3) m/s of the centres of mass, in the frame before impact_frames."""
        return self._impacts[1]

    @cached_property
    def _impacts(self) -> tuple[np.ndarray, np.ndarray]:
        return bone_impacts(self.states[:self.valid], self.touching[:self.valid])
