"""Live plots: energy against what was put in, joint gap, pace."""
from __future__ import annotations

from collections import deque

import numpy as np
import viser
from viser import uplot

from ...physics.joint_gap import JointGap
from ..sources.source import Frame, Report

PERIOD = 0.25
"""s between two points."""

SPAN = 20.0
"""s on the wall that are shown."""

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
        self._measured: object = None

    def show(self, frame: Frame, report: Report, now: float) -> None:
        """Take a frame and a report at ``now`` s of a steady clock; draws at a modest rate."""
        if now < self._next:
            return
        if frame.scene != self._scene or frame.time < self._last[0]:
            self._begin(frame)
        elif now - self._last[1] < 2 * PERIOD:
            pace = (frame.time - self._last[0]) / (now - self._last[1])
            self.pace.add(frame.time, pace, 0.0 if report.paused else report.pace)
        self._next, self._last = now + PERIOD, (frame.time, now)
        # Without what is less than a nanometre: rounding, which would fill the plot.
        gap = 1e6 * self._gaps.gaps(frame.state).max(initial=0.0)
        self.gap.add(frame.time, round(float(gap), 3))
        measures = report.measures
        if measures and measures is not self._measured:
            self._measured = measures
            put_in = measures['work_of_pushes_J'] + measures.get('work_of_grabs_J', 0.0)
            self.energy.add(frame.time, put_in + measures['energy_excess_J'], put_in)

    def _begin(self, frame: Frame) -> None:
        self._scene = frame.scene
        self._gaps = JointGap(frame.scene)
        for plot in (self.energy, self.gap, self.pace):
            plot.clear()


class _Plot:
    """Some lines over the last while."""

    def __init__(self, server: viser.ViserServer, title: str,
                 lines: tuple[tuple[str, str], ...]) -> None:
        self._rows: deque[tuple[float, ...]] = deque(maxlen=round(SPAN / PERIOD))
        self._width = 1 + len(lines)
        series = (uplot.Series(label='s'), *(
            uplot.Series(label=label, stroke=color, width=2) for label, color in lines))
        self.handle = server.gui.add_uplot(
            self._data(), series, title=title, height=HEIGHT, padding=PADDING,
            scales={'x': uplot.Scale(time=False)})

    def add(self, *row: float) -> None:
        """Add one point to each line: the instant, then the values; not finite, none."""
        if not np.isfinite(row).all() or (self._rows and row[0] <= self._rows[-1][0]):
            return
        self._rows.append(row)
        self.handle.data = self._data()

    def clear(self) -> None:
        """Begin anew."""
        self._rows.clear()
        self.handle.data = self._data()

    def _data(self) -> tuple[np.ndarray, ...]:
        rows = np.array(self._rows, float).reshape(-1, self._width)
        return tuple(np.ascontiguousarray(column) for column in rows.T)
