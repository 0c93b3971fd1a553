"""Detects that a fall is over: no bone moves any more."""
from __future__ import annotations

import numpy as np

from .sources.source import Frame

TOLERANCE = 0.002
"""m that a bone may drift; one that is about to fall moves farther within PERIOD."""

PERIOD = 1.0
"""s without motion."""


class RestDetector:
    """Compares successive frames that a page shows."""

    def __init__(self) -> None:
        self._since = 0.0
        self._positions: np.ndarray | None = None

    def is_at_rest(self, frame: Frame, paused: bool, now: float) -> bool:
        """Whether all bones have kept their positions for PERIOD without a pause.

        ``now``: s of a steady clock.
        """
        positions = frame.state.positions
        if (paused or self._positions is None or positions.shape != self._positions.shape
                or not np.abs(positions - self._positions).max() <= TOLERANCE):
            self._since, self._positions = now, positions
        return now - self._since >= PERIOD
