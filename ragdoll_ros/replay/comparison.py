"""How far two runs of the same scene part, and when."""
from __future__ import annotations

import numpy as np

from ..model.scene import SECOND
from ..physics.simulation import Simulation

APART = (1e-12, 1e-9, 1e-6, 1e-3, 1e-2, 1e-1, 1.0)
"""m: distances of a bone in one run from itself in the other that are looked for."""


class Comparison:
    """Takes two runs tick by tick, and tells where they part."""

    def __init__(self) -> None:
        self._rows: list[str] = []
        self._last = self._farthest = ''
        self._most = -1.0

    def take(self, tick: int, one: Simulation, other: Simulation) -> None:
        """Look at both after the same tick."""
        gaps = np.linalg.norm(one.state.positions - other.state.positions, axis=1)
        index = int(gaps.argmax())
        gap = float(gaps[index])
        bone = one.scene.bone_names[index]
        self._last = f'{gap:.3g} m ({bone}) at tick {tick}'
        while len(self._rows) < len(APART) and gap > APART[len(self._rows)]:
            self._rows.append(f'{APART[len(self._rows)]:11.0e} m {tick:9d} '
                              f'{one.time / SECOND:10.2f} s  {bone}')
        if gap > self._most:
            self._most, self._farthest = gap, self._last

    def lines(self) -> list[str]:
        """What was found, as a table."""
        head = ' apart by more   at tick   simulated  bone'
        rows = [head, *self._rows] if self._rows else [f'never apart by more than {APART[0]:.0e} m']
        return [*rows, f'farthest: {self._farthest}', f'at the end: {self._last}']
