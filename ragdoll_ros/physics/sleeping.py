"""SleepDetector: when a scene may sleep, because nothing has moved for a while."""
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
"""ns that all bones must be still before the scene sleeps; longer in weak gravity, under which all
goes slower as its root. In 44 starts of the report bones that were not put to sleep then moved 2 mm
more within 3 s in the median, as they do after 0.5 s, at the most 15 mm; 60 mm after 0.2 s."""

EARTH = 9.8
"""m/s^2: gravity for which the three above were measured."""


class SleepDetector:
    """Watches the bones of a scene, tick by tick."""

    def __init__(self, scene: Scene) -> None:
        self._sizes = np.array([max(bone.shape.half_extents) for bone in scene.bones])
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
        self.disturb()

    def disturb(self) -> None:
        """Begin anew to wait."""
        self._still = 0
        """ns for which all have been still."""

    def update(self, state: State, kinetic: np.ndarray, tick: int) -> bool:
        """Whether all have been still for long enough, after one more tick (ns).

        ``kinetic`` (d,) J are the dolls' energies of motion.
        """
        if not self._pulled or self._moves(state, kinetic):
            self.disturb()
            return False
        if not self._still:
            self._since = state
        self._still += tick
        if self._still < self._time:
            return False
        self.disturb()
        displacement = np.abs(state.positions - self._since.positions).max()
        turn = rotation.angle_between(state.orientations, self._since.orientations)
        return bool(max(displacement, (turn * self._sizes).max()) < self._displacement)

    def _moves(self, state: State, kinetic: np.ndarray) -> bool:
        """Whether any bone is faster than still; in most ticks the energies say so."""
        return bool((kinetic > self._most).any()
                    or np.abs(state.linear_velocities).max() > self._speed
                    or (np.abs(state.angular_velocities).max(axis=1)
                        * self._sizes).max() > self._speed)
