"""The limited joint angles of a scene, compiled."""
from __future__ import annotations

import numpy as np

from ..model.coordinates import DofLayout, GeneralizedState
from .kernels.loaded import kernels
from .plain.limits import AT_LIMIT, JointLimits


class CompiledLimits(JointLimits):
    """The same in one go each."""

    def __init__(self, layout: DofLayout) -> None:
        super().__init__(layout)
        self._places = np.stack(layout.limited).astype(np.int64)
        self._bounds = np.stack(layout.limits).astype(float)

    def is_active(self, coordinates: GeneralizedState, duration: float) -> bool:
        self._look(coordinates)
        return kernels.is_active(self._past, self._speeds, duration, AT_LIMIT, self._held)

    def approach(self, coordinates: GeneralizedState, soon: float) -> float:
        self._look(coordinates)
        return kernels.approach(self._past, self._speeds, soon)

    def _look(self, coordinates: GeneralizedState) -> None:
        if self._known is not coordinates:
            self._past, self._speeds = np.empty((2, len(self._held)))
            self._most = kernels.limits(self._places, self._bounds, coordinates.q, coordinates.v,
                                        self._past, self._speeds)
            self._known = coordinates
