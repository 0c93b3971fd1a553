"""Sums over dolls, and that energy and momentum are kept, compiled."""
from __future__ import annotations

import numpy as np

from ..model.state import State
from .kernels.loaded import kernels
from .motion import Motion
from .plain.conservation import ConservationProjection
from .plain.mechanics import Mechanics


class CompiledMechanics(Mechanics):
    """The sums over each doll, in one go."""

    def motion(self, state: State) -> Motion:
        """All sums at once."""
        sums = np.empty((len(self.doll_masses), 20))
        kernels.motion(self.masses, self.inertias, self.doll_of, self.gravity, state.rows, sums)
        return Motion.of(sums)


class CompiledProjection(ConservationProjection):
    """Keeps the momentum in one go."""

    def keep_momentum(self, state: State, before: Motion, after: Motion, duration: float,
                      impulse: np.ndarray | float = 0.0, moment: np.ndarray | float | None = 0.0,
                      touched: np.ndarray | None = None
                      ) -> tuple[State, Motion, np.ndarray | None]:
        """State and motion with the momentum that is due."""
        if self._single.any():
            return super().keep_momentum(state, before, after, duration, impulse, moment, touched)
        dolls, given = len(self._single), np.zeros((len(self._single), 6))
        given[:, :3] = impulse
        given[:, 3:] = 0.0 if moment is None else moment
        rows, sums = state.rows.copy(), after.sums.copy()
        kernels.keep_momentum(
            self._mechanics.doll_masses, self._mechanics.doll_of, self._gravity, duration, given,
            moment is not None, np.zeros(dolls, bool) if touched is None else touched,
            before.sums, sums, rows)
        return State.of(rows), Motion.of(sums), None
