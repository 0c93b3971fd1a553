"""Whether a fall is over."""
from __future__ import annotations

import numpy as np

from ..sources.source import Frame

TOLERANCE = 0.002
"""m that a bone at rest may drift; one that is about to fall moves farther within PERIOD."""

PERIOD = 1.0
"""s without motion after which a fall is over."""


class Rest:
    """Observes the newest frames of a source."""

    def __init__(self) -> None:
        self._positions: np.ndarray | None = None
        self._since = 0.0

    def update(self, frame: Frame, paused: bool, now: float) -> bool:
        """Whether all bones have been at rest for PERIOD; ``now``: s of a steady clock."""
        positions, last = frame.state.positions, self._positions
        if (paused or last is None or positions.shape != last.shape
                or not np.abs(positions - last).max() <= TOLERANCE):
            self._since, self._positions = now, positions
        return now - self._since >= PERIOD
