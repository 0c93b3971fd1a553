"""Live plots: energy against what was put in, joint gap, pace."""
from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np
import viser
from viser import uplot

from ...physics.rigid_body import JointGap
from ..sources.source import Frame, Report

PERIOD = 0.25
"""s between two points."""

SPAN = 20.0
"""s of the timeline that are shown."""

MOST = 600
"""Points that are kept: 150 s on the wall, which hold the timeline's 60 s at half the real time."""

HEIGHT = 170

PADDING = (10, 16, 0, 26)
"""Pixels above, right, below, left: room for the halves of the outermost numbers, and for up to
1,000,000 on the left, where four digits have room without."""


class Plots:
    """Three plots over simulated time."""

    def __init__(self, server: viser.ViserServer) -> None:
        self.energy = _Plot(server, 'Energy since the start, J', (
            ('doll', 'crimson'), ('put in by pushes and grabs', 'royalblue')))
        self.gap = _Plot(server, 'Joint gap, µm', (('largest', 'darkorange'),))
        self.pace = _Plot(server, 'Pace, simulated s each s', (
            ('is', 'seagreen'), ('asked for', 'silver')))
        self._scene: object = None
        self._next = 0.0
        self._last = (0.0, 0.0)
        self._instant = 0.0
        self._measured: object = None

    def take(self, frame: Frame, instant: float, report: Report, now: float) -> None:
        """Take a frame at an ``instant`` of the timeline, s, and a report, at a modest rate.

        ``now`` is s of a steady clock. With a reset a run begins; with another scene, or a
        recording from its start, the timeline itself, and what was on it is forgotten.
        """
        begins = frame.scene is not self._scene or frame.time < self._last[0]
        if now < self._next and not begins:
            return
        if begins:
            self._begin(frame, instant)
        elif now - self._last[1] < 2 * PERIOD:
            pace = (frame.time - self._last[0]) / (now - self._last[1])
            self.pace.add(instant, frame.time, pace, 0.0 if report.paused else report.pace)
        self._next, self._last, self._instant = now + PERIOD, (frame.time, now), instant
        # Without what is less than a nanometre: rounding, which would fill the plot.
        gap = 1e6 * self._gaps.gaps(frame.state).max(initial=0.0)
        self.gap.add(instant, frame.time, round(float(gap), 3))
        measures = report.measures
        if measures and measures is not self._measured:
            self._measured = measures
            put_in = measures['work_of_pushes_J'] + measures.get('work_of_grabs_J', 0.0)
            self.energy.add(instant, frame.time, put_in + measures['energy_excess_J'], put_in)

    def show(self, instant: float | None = None) -> None:
        """Draw the SPAN s before an instant of the timeline; None: before the newest."""
        for plot in (self.energy, self.gap, self.pace):
            plot.show(instant)

    def _begin(self, frame: Frame, instant: float) -> None:
        anew = frame.scene is not self._scene or instant < self._instant
        if frame.scene is not self._scene:
            self._scene = frame.scene
            self._gaps = JointGap(frame.scene)
        for plot in (self.energy, self.gap, self.pace):
            plot.begin(anew)


class _Plot:
    """Some lines over the last while: of one run, from a reset to the next."""

    def __init__(self, server: viser.ViserServer, title: str,
                 lines: tuple[tuple[str, str], ...]) -> None:
        self._rows: deque[tuple[float, ...]] = deque(maxlen=MOST)
        """Instant of the timeline, number of the run, s simulated, values."""
        self._run = 0
        self._shown: object = None
        self._width = 1 + len(lines)
        series = (uplot.Series(label='s'), *(
            uplot.Series(label=label, stroke=color, width=2) for label, color in lines))
        self.handle = server.gui.add_uplot(
            self._data(()), series, title=title, height=HEIGHT, padding=PADDING, visible=False,
            scales={'x': uplot.Scale(time=False)})

    def add(self, instant: float, *row: float) -> None:
        """Add one point to each line: s simulated, then the values; not finite, none."""
        if not np.isfinite(row).all() or (self._rows and instant <= self._rows[-1][0]):
            return
        self._rows.append((instant, self._run, *row))

    def begin(self, anew: bool) -> None:
        """Begin a run; ``anew``: on a timeline that begins with it."""
        self._run += 1
        if anew:
            self._rows.clear()

    def show(self, instant: float | None) -> None:
        """Draw the last SPAN s of the run at an instant; at None, of the newest."""
        rows = [row for row in self._rows if instant is None or row[0] <= instant]
        run = self._run if instant is None or not rows else rows[-1][1]
        rows = [row[2:] for row in rows if row[1] == run and row[0] > rows[-1][0] - SPAN]
        shown = rows and (rows[0], rows[-1], len(rows))
        if shown != self._shown:
            self._shown = shown
            # Hidden while empty: uPlot, once shown nothing, has no scale for what comes later.
            self.handle.visible = bool(rows)
            if rows:
                self.handle.data = self._data(rows)

    def _data(self, rows: Sequence[tuple[float, ...]]) -> tuple[np.ndarray, ...]:
        table = np.array(rows, float).reshape(-1, self._width)
        return tuple(np.ascontiguousarray(column) for column in table.T)
