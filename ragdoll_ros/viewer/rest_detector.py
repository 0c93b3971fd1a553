"""Whether a fall is over: nothing of it moves any more."""
from __future__ import annotations

import numpy as np

from .sources.source import Frame

STILL = 0.002
"""m that a bone may drift; one that is about to fall is faster within PERIOD."""

PERIOD = 1.0
"""s for which nothing moves."""


class Rest:
    """Looks at the frames that a page shows, one after another."""

    def __init__(self) -> None:
        self._since = 0.0
        self._positions: np.ndarray | None = None

    def lies(self, frame: Frame, paused: bool, now: float) -> bool:
        """Whether all bones have been where they are for PERIOD while time went on.

        ``now``: s of any steady clock.
        """
        positions = frame.state.positions
        if (paused or self._positions is None or positions.shape != self._positions.shape
                or not np.abs(positions - self._positions).max() <= STILL):
            self._since, self._positions = now, positions
        return now - self._since >= PERIOD
