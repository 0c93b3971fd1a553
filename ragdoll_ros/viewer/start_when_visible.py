"""Starts the first fall once a page shows it."""
from __future__ import annotations

import threading

import viser

from .sources.source import Source

RENDER_TIMEOUT = 5.0
"""s that a page may take to render an image before it is asked again."""


class StartWhenVisible:
    """Resumes a paused source once a page has drawn it.

    Without a page it resumes after ``timeout`` s, or never if that is None. `update` is called
    repeatedly by one thread, with the open pages and the time, s of a steady clock.
    """

    def __init__(self, source: Source, timeout: float | None) -> None:
        self._source, self._timeout = source, timeout
        self._begin: float | None = None
        self._rendering: threading.Thread | None = None
        self._is_drawn = False
        self.is_done = False

    def update(self, clients: list[viser.ClientHandle], has_frame: bool, now: float) -> None:
        """Request an image from a page that has a frame to draw, or resume the source."""
        if self.is_done:
            return
        self._begin = now if self._begin is None else self._begin
        timed_out = (not clients and self._timeout is not None
                     and now - self._begin >= self._timeout)
        if self._is_drawn or timed_out:
            self.is_done = self._source.pause(False)
        elif clients and has_frame and not (self._rendering and self._rendering.is_alive()):
            self._rendering = threading.Thread(target=self._render, args=(clients[-1],),
                                               daemon=True)
            self._rendering.start()

    def _render(self, client: viser.ClientHandle) -> None:
        """Wait for an image: a page renders it after it has drawn what it was sent before."""
        try:
            client.get_render(16, 16, timeout=RENDER_TIMEOUT)
        except (TimeoutError, RuntimeError):
            # The page was closed, or is in a background tab.
            return
        self._is_drawn = True
