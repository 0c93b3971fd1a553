"""A line of the panel: the impact of a run that was largest in proportion to its limit."""
from __future__ import annotations

import viser

from .sources.source import Frame
from .widgets.form import GREY, colored


class WorstImpact:
    """A line in the current GUI container, without text until there is an impact with a limit."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self.line = gui.add_html('')
        self._run = -1
        self._ratio = 0.0
        """Of the worst impact of this run so far."""

    def add(self, frame: Frame) -> None:
        """Take note of the impacts of a new frame; another run begins anew."""
        if frame.run != self._run:
            self._run, self._ratio = frame.run, 0.0
            self._set('')
        for arrow in frame.impacts:
            if arrow.ratio > self._ratio:
                self._ratio = arrow.ratio
                self._set(f'Worst impact: {arrow.text}, at {frame.time:.2f} s')

    def _set(self, text: str) -> None:
        content = colored(text, GREY)
        if self.line.content != content:
            self.line.content = content
