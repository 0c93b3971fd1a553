"""Energy and momentum of dolls, compiled."""
from __future__ import annotations

import numpy as np

from ..model.state import State
from .kernels.loaded import kernels
from .motion import Motion
from .plain.mechanics import Mechanics


class CompiledMechanics(Mechanics):
    """The sums over each doll, in one go."""

    def motion(self, state: State) -> Motion:
        """All sums at once."""
        sums = np.empty((len(self.doll_masses), 20))
        kernels.motion(self.masses, self.inertias, self.doll_of, self.gravity, state.rows, sums)
        return Motion.of(sums)
