"""What bones can reach, compiled."""
from __future__ import annotations

import math

import numpy as np

from ..model.scene import Scene
from ..model.state import State
from .engine.protocol import GROUND
from .kernels.loaded import kernels
from .plain.reach import MARGIN, Reach


class CompiledReach(Reach):
    """Heights over the ground and speeds, bone by bone."""

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        self._least = math.inf

    def heights(self, state: State) -> np.ndarray:
        if self._ground is None:
            return np.full(len(self._radii), math.inf)
        if self._last[0] is not state:
            found = np.empty(len(self._radii))
            self._least = kernels.heights(self._sizes, self._normal, self._ground.offset,
                                          state.rows, found)
            self._last = (state, found)
        return self._last[1]

    def clearance(self, state: State) -> float:
        """Distance, m, that all bones keep from the ground."""
        if self._ground is None:
            return math.inf
        self.heights(state)
        return self._least

    def falling(self, state: State, soon: float) -> float:
        if self._ground is None:
            return 0.0
        return kernels.falling(self._radii, self._normal, MARGIN, soon, state.rows,
                               self.heights(state))

    def broadphase_pairs(self, state: State, duration: float, acceleration: float,
             touching: set[tuple[int, int]]) -> set[tuple[int, int]]:
        """Pairs of dolls that may touch within ``duration`` s; GROUND stands for the ground.

        As the plain one, but with each bone's own height: by the doll's fastest point, as joints
        hand speed on.
        """
        found = set()
        if self._ground is not None:
            low = np.empty(len(self._bounds) - 1, bool)
            if kernels.near_ground(self._radii, MARGIN, duration, acceleration * duration,
                                   self._bounds, state.rows, self.heights(state), low):
                found = {(int(doll), GROUND) for doll in np.flatnonzero(low)}
        if len(self._bounds) == 2:
            return found
        return found | self._close(state.positions, self._far(state, duration, acceleration))

    def closing(self, state: State) -> float:
        return kernels.fastest(self._radii, state.rows)[1]

    def change(self, before: State, after: State) -> float:
        return kernels.change(self._radii, before.rows, after.rows)

    def max_angular_speed(self, state: State) -> float:
        return kernels.fastest(self._radii, state.rows)[0]

    def max_tip_speed(self, state: State) -> float:
        return kernels.fastest(self._radii, state.rows)[2]
