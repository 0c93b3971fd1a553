"""Live plots: energy and work put in, joint gap, real-time factor."""
from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np
import viser
from viser import uplot

from ...physics.rigid_body import JointGap
from ..browser.scripts import add_listener
from ..sources.source import Frame, SourceStatus

PERIOD = 0.25
"""s of wall time between two pictures, and over which the real-time factor is measured."""

SPAN = 20.0
"""s of the timeline that a plot shows."""

MAX_POINTS = 30_000
"""Kept: as many as there are frames on the timeline."""

COLUMNS = 150
"""Of a picture: in each, the smallest and the largest value are drawn."""

HEIGHT = 170

PADDING = (10, 16, 0, 26)
"""Pixels above, right, below, left: room for the halves of the outermost labels, and for up to
1,000,000 on the left."""


class Plots:
    """Three plots over simulated time, in the GUI container that is current.

    They are drawn and sent while a page has them in view.
    """

    def __init__(self, server: viser.ViserServer) -> None:
        self.energy = _Plot(server, 'Energy since the start, J', (
            ('dolls', 'crimson'), ('work of pushes and grabs', 'royalblue')))
        self.gap = _Plot(server, 'Joint gap, µm', (('largest', 'darkorange'),))
        self.real_time_factor = _Plot(server, 'Real-time factor', (
            ('measured', 'seagreen'), ('requested', 'silver')))
        self.events = add_listener(server.gui, 'plots', 'plots.js', self._take)
        self._seen_by: set[int] = set()
        """Pages that have them in view."""
        self._new: list[tuple[float, Frame]] = []
        """Frames whose joint gap is not computed yet, with their instants: one at a time takes
        four times as long."""
        self._last: Frame | None = None
        self._measured = (0.0, 0.0)
        """Simulated and wall time, s, since which the real-time factor is measured."""
        self._instant = self._next = 0.0

        @server.on_client_disconnect
        def _(client: viser.ClientHandle) -> None:
            self._seen_by.discard(client.client_id)

    def _take(self, page: int, text: str) -> None:
        """Take note of whether a page has the plots in view; called in viser's thread."""
        if text == 'seen':
            self._seen_by.add(page)
            self._next = 0.0
        else:
            self._seen_by.discard(page)

    def add(self, frame: Frame, instant: float, status: SourceStatus, now: float) -> None:
        """Add points for a frame at an ``instant`` of the timeline, s.

        ``now`` is s of a steady clock. A reset begins a run. Another scene, which begins the
        timeline, or any move back in a recording clears the plots.
        """
        last = self._last
        if last is None or frame.scene is not last.scene or frame.run != last.run or (
                frame.time < last.time):
            self._begin(frame, instant, now)
        self._last, self._instant = frame, instant
        self._measure(frame, instant, status, now)
        self._new.append((instant, frame))
        self.energy.add(instant, frame.time, frame.energy, frame.work)

    def _measure(self, frame: Frame, instant: float, status: SourceStatus, now: float) -> None:
        """Measure the real-time factor over a PERIOD; a longer one was a pause or a stall."""
        simulated, elapsed = frame.time - self._measured[0], now - self._measured[1]
        if elapsed < PERIOD:
            return
        if elapsed < 2 * PERIOD:
            self.real_time_factor.add(instant, frame.time, simulated / elapsed,
                                      0.0 if status.paused else status.real_time_factor)
        self._measured = frame.time, now

    def show(self, instant: float | None, now: float) -> None:
        """Draw the SPAN s before an instant of the timeline once per PERIOD; None: before the
        newest point. ``now`` is s of a steady clock.
        """
        if now < self._next:
            return
        self._next = now + PERIOD
        self._add_gaps()
        if not self._seen_by:
            return
        for plot in (self.energy, self.gap, self.real_time_factor):
            plot.show(instant)

    def _add_gaps(self) -> None:
        """Compute the joint gap of the new frames."""
        if not self._new:
            return
        rows = np.stack([frame.state.rows for _, frame in self._new])
        # Less than a nanometre is rounding, which would fill the plot.
        gaps = np.round(1e6 * self._gaps.of_rows(rows).max(axis=1, initial=0.0), 3).tolist()
        for (instant, frame), gap in zip(self._new, gaps, strict=True):
            self.gap.add(instant, frame.time, gap)
        self._new.clear()

    def _begin(self, frame: Frame, instant: float, now: float) -> None:
        """Begin a run of the plots; a new scene or an earlier instant clears them."""
        self._add_gaps()
        is_new_scene = self._last is None or frame.scene is not self._last.scene
        clear = is_new_scene or instant < self._instant
        if is_new_scene:
            self._gaps = JointGap(frame.scene)
        self._measured = frame.time, now
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
        """Add one point to each line. ``row``: simulated time in s, then the values.

        A row that is not finite, or an instant not later than the last one, is ignored.
        """
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
                self.handle.data = self._data(thinned(np.array(rows), COLUMNS))

    def _data(self, rows: Sequence[tuple[float, ...]] | np.ndarray) -> tuple[np.ndarray, ...]:
        table = np.array(rows, float).reshape(-1, self._width)
        return tuple(np.ascontiguousarray(column) for column in table.T)


def thinned(rows: np.ndarray, columns: int) -> np.ndarray:
    """Return rows (k, w), of ascending first values, but those a picture does not show.

    The picture's width is divided into equal columns. In each column, the rows with the smallest
    and largest value of each line are kept; so are the first and last row of all.
    """
    if len(rows) <= 2 * columns:
        return rows
    begin, end = rows[0, 0], rows[-1, 0]
    column = np.minimum((rows[:, 0] - begin) / (end - begin) * columns, columns - 1).astype(int)
    firsts = np.flatnonzero(np.diff(column, prepend=-1))
    kept = [0, len(rows) - 1]
    for line in rows[:, 1:].T:
        for extreme in (np.minimum, np.maximum):
            value = extreme.reduceat(line, firsts)[np.searchsorted(firsts, np.arange(len(rows)),
                                                                   'right') - 1]
            found = np.flatnonzero(line == value)
            kept += found[np.diff(column[found], prepend=-1) > 0].tolist()
    return rows[np.unique(kept)]
