"""Track: bone states at ticks, interpolated between them."""
import bisect

import numpy as np

from ...model.state import State
from ..kernels.swing.loaded import advance_chains


class Track:
    """States of bones over the last ``memory`` s; track(time) interpolates them.

    See kernels/swing/bone_path.py. Before the first and after the last state it is constant.
    """

    def __init__(self, memory: float = 0.02) -> None:
        self._memory = memory
        self._times: list[float] = []
        self._rows: list[np.ndarray] = []

    def add(self, time: float, state: State) -> None:
        """Add the state at ``time`` s; a time not later than the last restarts the track."""
        if self._times and time <= self._times[-1]:
            self._times.clear()
            self._rows.clear()
        old = max(bisect.bisect_right(self._times, time - self._memory) - 1, 0)
        del self._times[:old], self._rows[:old]
        self._times.append(time)
        self._rows.append(state.rows)

    def states(self, begin: float, end: float) -> tuple[np.ndarray, np.ndarray]:
        """Times (k,) s and states (k, b, 13) that tell the path from ``begin`` to ``end`` s."""
        first = max(bisect.bisect_right(self._times, begin) - 1, 0)
        last = max(bisect.bisect_left(self._times, end), first) + 1
        return np.array(self._times[first:last]), np.array(self._rows[first:last])

    def __call__(self, time: float) -> State:
        """State at ``time`` s."""
        if time >= self._times[-1]:
            return State.of(self._rows[-1])
        times, rows = self.states(time, time)
        out = np.empty(rows.shape[1:])
        advance_chains.bones_at(time, times, rows, out)
        return State.of(out)
