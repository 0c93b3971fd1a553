"""SleepDetector: which dolls may sleep, because they have not moved for a while."""
from __future__ import annotations

import math

import numpy as np

from ..model import rotation
from ..model.scene import SECOND, Scene
from ..model.state import State

HUMAN = 1.4
"""m: extent of the default doll, for which the next two were measured."""

REST_SPEED = 0.05
"""m/s, and rad/s times the bone's size, below which a bone of the default doll counts as still:
more than the flutter of a joint that leans on its limit, less than any fall gives within 10 ms.
For other dolls it goes with the root of their size."""

REST_DISPLACEMENT = 0.0012
"""m that a still bone of the default doll may have moved in REST_TIME: limbs that sag against
their joints' damping slower than 4 mm/s are stopped. For other dolls it goes with their size."""

REST_TIME = 3 * SECOND // 10
"""ns that all bones must be still before a doll sleeps; longer in weak gravity, under which all
goes slower as its root. In 44 starts of the report bones that were not put to sleep then moved 2 mm
more within 3 s in the median, as they do after 0.5 s, at the most 15 mm; 60 mm after 0.2 s."""

EARTH = 9.8
"""m/s^2: gravity for which the three above were measured."""


class SleepDetector:
    """Watches the bones of a scene, tick by tick."""

    def __init__(self, scene: Scene) -> None:
        self._sizes = np.array([max(bone.shape.half_extents) for bone in scene.bones])
        self._lever = np.ones((len(scene.bones), 6))
        self._lever[:, 3:] = self._sizes[:, None]
        """(n, 6): what makes speeds, m/s, of velocities and spins."""
        self._first = np.array([own.start for own in scene.bone_slices])
        self._doll = scene.doll_of_bone
        size = min(placement.doll.extent for placement in scene.dolls) / HUMAN
        gravity = math.hypot(*scene.gravity)
        self._pulled = gravity > 0
        slower = max(1.0, math.sqrt(EARTH / gravity)) if gravity else math.inf
        self._speed = math.sqrt(size) / slower * REST_SPEED
        self._displacement = size * REST_DISPLACEMENT
        self._time = slower * REST_TIME
        # A bone that is still has at most m v^2 / 2 for its speed and less than 3 times that for
        # its spin, as no radius of gyration is longer than its largest half extent.
        masses = np.array([placement.doll.mass for placement in scene.dolls])
        self._most = 2 * masses * (2 * self._speed) ** 2
        self._still = np.zeros(len(scene.dolls), np.int64)
        """ns for which each doll has been still."""
        self._since = np.zeros((len(scene.bones), 7))
        """Where its bones were as that began."""

    def disturb(self, dolls: np.ndarray | slice = slice(None)) -> None:
        """Begin anew to wait, for these dolls (d,) or for all."""
        self._still[dolls] = 0

    def update(self, state: State, kinetic: np.ndarray, tick: int) -> np.ndarray:
        """Which dolls (d,) have been still for long enough, after one more tick (ns).

        ``kinetic`` (d,) J are the dolls' energies of motion.
        """
        slow = kinetic <= self._most
        if not self._pulled or not np.count_nonzero(slow):
            self.disturb()
            return np.zeros(len(slow), bool)
        speeds = np.abs(state.rows[:, 7:] * self._lever).max(axis=1)
        slow &= np.maximum.reduceat(speeds, self._first) <= self._speed
        begun = (slow & (self._still == 0))[self._doll]
        self._since[begun] = state.rows[begun, :7]
        self._still = np.where(slow, self._still + tick, 0)
        ready = self._still >= self._time
        if not ready.any():
            return ready
        moved = np.maximum(
            np.abs(state.positions - self._since[:, :3]).max(axis=1),
            rotation.angle_between(state.orientations, self._since[:, 3:]) * self._sizes)
        crept = np.maximum.reduceat(moved, self._first) >= self._displacement
        self.disturb(crept)
        return ready & ~crept
