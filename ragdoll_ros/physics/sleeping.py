"""SleepDetector: which dolls have been still long enough to sleep. Engine.advance() wakes them."""
from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from ..model import rotation
from ..model.scene import SECOND, Scene
from ..model.scene_change import SceneChange
from ..model.state import State
from .engine.protocol import Engine
from .stability import ACCELERATION, SOLVED

REFERENCE_EXTENT = 1.4
"""m: extent of the default doll, for which REST_SPEED and REST_DISPLACEMENT were measured."""

REST_SPEED = 0.05
"""m/s, and rad/s times bone size: speed below which a bone of the default doll is still; above
the jitter of a joint at its limit, below what any fall gives in 10 ms. Scales with the square root
of the extent."""

REST_DISPLACEMENT = 0.0012
"""m by which a still bone of the default doll may move in REST_TIME: limbs that sag against joint
damping slower than 4 mm/s are stopped. Scales with the doll's extent."""

REST_TIME = 3 * SECOND // 10
"""ns for which all bones of a doll must be still; longer in weak gravity, by its inverse square
root. In 44 starts of the report, bones that were not put to sleep then moved 2 mm more within 3 s
in the median, as after 0.5 s, and 15 mm at most; 60 mm after 0.2 s."""

REFERENCE_GRAVITY = 9.8
"""m/s^2: gravity for which the values above were measured."""


class SleepDetector:
    """Tracks for how long each of d dolls has been still."""

    def __init__(self, scene: Scene) -> None:
        self._sizes = np.concatenate([placement.doll.largest_half_extents
                                      for placement in scene.dolls])
        self._lever = np.ones((len(scene.bones), 6))
        self._lever[:, 3:] = self._sizes[:, None]
        """(n, 6): factors from linear and angular velocities to speeds, m/s."""
        self._first = np.array([own.start for own in scene.bone_slices])
        self._doll = scene.doll_of_bone
        sizes = np.array([placement.doll.extent for placement in scene.dolls]) / REFERENCE_EXTENT
        gravity = math.hypot(*scene.gravity)
        self._has_gravity = gravity > 0
        slower = max(1.0, math.sqrt(REFERENCE_GRAVITY / gravity)) if gravity else math.inf
        self._speed = np.sqrt(sizes) / slower * REST_SPEED
        self._displacement = sizes * REST_DISPLACEMENT
        """(d,) m/s and m: each doll rests by its own size, whatever else is in the scene."""
        self._time = slower * REST_TIME
        self._masses = np.array([placement.doll.mass for placement in scene.dolls])
        # A still bone has at most m v^2 / 2 of linear and less than 3 times that of rotational
        # energy, as its radius of gyration is at most its largest half extent.
        self.max_kinetic = 2 * self._masses * (2 * self._speed) ** 2
        """(d,) J: bound on the kinetic energy of dolls that are still."""
        self._still = np.zeros(len(scene.dolls), np.int64)
        """ns for which each doll has been still."""
        self._wait = np.full(len(scene.dolls), self._time)
        """ns for which each doll must be still."""
        self.watched = np.zeros(len(scene.dolls), bool)
        """(d,): which watch() has chosen, and have been still since."""
        self._bound = np.full(len(scene.dolls), math.inf)
        """(d,) J: kinetic energies that those do not reach."""
        self._since = np.zeros((len(scene.bones), 7))
        """(n, 7): poses of the bones when their doll became still."""
        self._restarted = False
        """Whether all timers are at their start."""

    def restart(self, dolls: np.ndarray | list[int] | slice = slice(None)) -> None:
        """Reset the timers of these dolls, a mask (d,) or indices, or of all."""
        self._still[dolls], self._wait[dolls] = 0, self._time
        self.watched[dolls], self._bound[dolls] = False, math.inf

    def continue_from(self, other: SleepDetector, change: SceneChange) -> None:
        """Take the timers of the dolls that stay from the detector of the scene before."""
        stay = change.old_dolls >= 0
        old = change.old_dolls[stay]
        for mine, theirs in ((self._still, other._still), (self._wait, other._wait),
                             (self.watched, other.watched), (self._bound, other._bound)):
            mine[stay] = theirs[old]
        bones = change.new_bones >= 0
        self._since[change.new_bones[bones]] = other._since[bones]

    def watch(self, dolls: np.ndarray, durations: np.ndarray,
              kinetic: np.ndarray) -> None:
        """Restart the timers of dolls (d,) that seem not to rest. They do rest if they are still
        for ``durations`` (d,) s and their kinetic energy is then at most that of
        _grown(``kinetic``), J.
        """
        self._still[dolls], self.watched[dolls] = 0, True
        self._wait[dolls] = np.maximum(self._time, durations[dolls] * SECOND)
        self._bound[dolls] = self._grown(kinetic)[dolls]

    def all_move(self, engine: Engine, driven: list[int]) -> bool:
        """Whether no doll can be still, by its kinetic energy, as its bone is ``driven``, or
        without gravity; if so, restarts all timers. For one doll in motion a third of the cost of
        find_ready().
        """
        still = engine.doll_totals.kinetic <= self.max_kinetic
        if driven:
            still[self._doll[driven]] = False
        if self._has_gravity and np.count_nonzero(still):
            self._restarted = False
            return False
        if not self._restarted:
            self.restart()
            self._restarted = True
        return True

    def find_ready(self, engine: Engine, tick: int, loaded: Iterable[int]) -> np.ndarray:
        """Which dolls (d,) to put to sleep, after one more tick (ns): whole clusters that are
        still and rest on the ground. ``loaded`` bones keep their dolls awake. Not to be called if
        all_move().
        """
        sleeping = engine.sleeping
        ready = self._update(engine.state, engine.doll_totals.kinetic, sleeping, tick)
        if dolls := self._doll[list(loaded)].tolist():
            self.restart(dolls)
            ready[dolls] = False
        if not np.count_nonzero(ready):
            return ready
        clusters = engine.cluster_of_doll
        ready |= sleeping
        awake = np.bincount(clusters, ~ready) > 0
        supported = np.bincount(clusters, engine.dolls_on_ground()) > 0
        return (supported & ~awake)[clusters] & ~sleeping

    def _update(self, state: State, kinetic: np.ndarray, sleeping: np.ndarray,
                tick: int) -> np.ndarray:
        """Which dolls (d,) that do not sleep yet have been still for long enough; ``kinetic`` J."""
        slow = kinetic <= self.max_kinetic
        speeds = np.abs(state.rows[:, 7:] * self._lever).max(axis=1)
        slow &= np.maximum.reduceat(speeds, self._first) <= self._speed
        begun = (slow & (self._still == 0))[self._doll]
        self._since[begun] = state.rows[begun, :7]
        self._still = np.where(slow, self._still + tick, 0)
        self.restart(~slow)
        ready = (self._still >= self._wait) & ~sleeping
        if not np.count_nonzero(ready):
            return ready
        moved = np.maximum(
            np.abs(state.positions - self._since[:, :3]).max(axis=1),
            rotation.angle_between(state.orientations, self._since[:, 3:]) * self._sizes)
        # Of the ready ones alone: else a doll's timer would depend on when others are ready.
        crept = ready & (np.maximum.reduceat(moved, self._first) >= (
            self._displacement * self._wait / self._time))
        faster = ready & (kinetic > self._bound)
        self._bound[faster] = self._grown(kinetic)[faster]
        self._still[crept | faster] = 0
        return ready & ~crept & ~faster

    def _grown(self, kinetic: np.ndarray) -> np.ndarray:
        """Energies (d,) J above which dolls count as faster than with ``kinetic`` (d,) J."""
        return ACCELERATION ** 2 * np.maximum(kinetic, self._masses * SOLVED ** 2 / 2)
