"""Live plots: energy and work put in, joint gap, real-time factor."""
from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np
import viser
from viser import uplot

from ...physics.ground_heights import JointGap
from ..sources.source import Frame, SourceStatus

PERIOD = 0.25
"""s between two points."""

SPAN = 20.0
"""s of the timeline that a plot shows."""

MAX_POINTS = 600
"""Kept: 150 s of wall time, which hold the timeline's 60 s at a real-time factor of 0.4."""

HEIGHT = 170

PADDING = (10, 16, 0, 26)
"""Pixels above, right, below, left: room for the halves of the outermost labels, and for up to
1,000,000 on the left."""


class Plots:
    """Three plots over simulated time."""

    def __init__(self, server: viser.ViserServer) -> None:
        self.energy = _Plot(server, 'Energy since the start, J', (
            ('dolls', 'crimson'), ('work of pushes and grabs', 'royalblue')))
        self.gap = _Plot(server, 'Joint gap, µm', (('largest', 'darkorange'),))
        self.real_time_factor = _Plot(server, 'Real-time factor', (
            ('measured', 'seagreen'), ('requested', 'silver')))
        self._scene: object = None
        self._next = 0.0
        self._last = (0.0, 0.0)
        """Simulated and wall time of the last point, s."""
        self._instant = 0.0
        self._measures: object = None

    def add(self, frame: Frame, instant: float, status: SourceStatus, now: float) -> None:
        """Add points for a frame at an ``instant`` of the timeline, s, once per PERIOD.

        ``now`` is s of a steady clock. A reset begins a run; another scene, or a recording from its
        start, begins the timeline and clears the plots.
        """
        is_new_run = frame.scene is not self._scene or frame.time < self._last[0]
        if now < self._next and not is_new_run:
            return
        if is_new_run:
            self._begin(frame, instant)
        elif now - self._last[1] < 2 * PERIOD:
            measured = (frame.time - self._last[0]) / (now - self._last[1])
            self.real_time_factor.add(instant, frame.time, measured,
                                      0.0 if status.paused else status.real_time_factor)
        self._next, self._last, self._instant = now + PERIOD, (frame.time, now), instant
        # Less than a nanometre is rounding, which would fill the plot.
        gap = 1e6 * self._gaps.gaps(frame.state).max(initial=0.0)
        self.gap.add(instant, frame.time, round(float(gap), 3))
        measures = status.measures
        if measures and measures is not self._measures:
            self._measures = measures
            work = measures['work_of_pushes_J'] + measures.get('work_of_grabs_J', 0.0)
            self.energy.add(instant, frame.time, work + measures['energy_excess_J'], work)

    def show(self, instant: float | None = None) -> None:
        """Draw the SPAN s before an instant of the timeline; None: before the newest point."""
        for plot in (self.energy, self.gap, self.real_time_factor):
            plot.show(instant)

    def _begin(self, frame: Frame, instant: float) -> None:
        clear = frame.scene is not self._scene or instant < self._instant
        if frame.scene is not self._scene:
            self._scene = frame.scene
            self._gaps = JointGap(frame.scene)
        for plot in (self.energy, self.gap, self.real_time_factor):
            plot.begin(clear)


class _Plot:
    """Lines over simulated time, of one run: from a reset to the next."""

    def __init__(self, server: viser.ViserServer, title: str,
                 lines: tuple[tuple[str, str], ...]) -> None:
        self._rows: deque[tuple[float, ...]] = deque(maxlen=MAX_POINTS)
        """Instant of the timeline, number of the run, simulated time in s, values."""
        self._run = 0
        self._shown: object = None
        self._width = 1 + len(lines)
        series = (uplot.Series(label='s'), *(
            uplot.Series(label=label, stroke=color, width=2) for label, color in lines))
        self.handle = server.gui.add_uplot(
            self._data(()), series, title=title, height=HEIGHT, padding=PADDING, visible=False,
            scales={'x': uplot.Scale(time=False)})

    def add(self, instant: float, *row: float) -> None:
        """Add one point to each line: simulated time in s, then values; ignored if not finite."""
        if not np.isfinite(row).all() or (self._rows and instant <= self._rows[-1][0]):
            return
        self._rows.append((instant, self._run, *row))

    def begin(self, clear: bool) -> None:
        """Begin a run; ``clear``: drop the runs before."""
        self._run += 1
        if clear:
            self._rows.clear()

    def show(self, instant: float | None) -> None:
        """Draw the last SPAN s of the run at an instant; None: of the newest."""
        rows = [row for row in self._rows if instant is None or row[0] <= instant]
        run = self._run if instant is None or not rows else rows[-1][1]
        rows = [row[2:] for row in rows if row[1] == run and row[0] > rows[-1][0] - SPAN]
        shown = rows and (rows[0], rows[-1], len(rows))
        if shown != self._shown:
            self._shown = shown
            # Hidden while empty: uPlot, shown without data, has no scale for later data.
            self.handle.visible = bool(rows)
            if rows:
                self.handle.data = self._data(rows)

    def _data(self, rows: Sequence[tuple[float, ...]]) -> tuple[np.ndarray, ...]:
        table = np.array(rows, float).reshape(-1, self._width)
        return tuple(np.ascontiguousarray(column) for column in table.T)
