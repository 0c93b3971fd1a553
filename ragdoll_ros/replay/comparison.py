"""Distance between two runs of the same scene over time."""
from __future__ import annotations

import numpy as np

from ..model.scene import SECOND
from ..physics.simulation import Simulation

THRESHOLDS = (1e-12, 1e-9, 1e-6, 1e-3, 1e-2, 1e-1, 1.0)
"""m, thresholds of the largest distance between a bone in one run and in the other."""


class Comparison:
    """Compares two runs tick by tick."""

    def __init__(self) -> None:
        self._rows: list[str] = []
        self._last = self._farthest = ''
        self._max_gap = -1.0

    def add(self, tick: int, one: Simulation, other: Simulation) -> None:
        """Compare both after the same tick."""
        gaps = np.linalg.norm(one.state.positions - other.state.positions, axis=1)
        index = int(gaps.argmax())
        gap = float(gaps[index])
        bone = one.scene.bone_names[index]
        self._last = f'{gap:.3g} m ({bone}) at tick {tick}'
        while len(self._rows) < len(THRESHOLDS) and gap > THRESHOLDS[len(self._rows)]:
            self._rows.append(f'{THRESHOLDS[len(self._rows)]:11.0e} m {tick:9d} '
                              f'{one.time / SECOND:10.2f} s  {bone}')
        if gap > self._max_gap:
            self._max_gap, self._farthest = gap, self._last

    def lines(self) -> list[str]:
        """The result as a table."""
        head = ' apart by more   at tick   simulated  bone'
        never = f'never apart by more than {THRESHOLDS[0]:.0e} m'
        rows = [head, *self._rows] if self._rows else [never]
        return [*rows, f'farthest: {self._farthest}', f'at the end: {self._last}']
