"""Starts the first fall once a page shows it."""
from __future__ import annotations

import threading

import numpy as np
import viser

from ..model.scene import Scene
from .sources.source import Frame, Source

RENDER_TIMEOUT = 5.0
"""s that a page may take to render an image before it is asked again."""

RETRY = 1.0
"""s between two requests to begin again: a node may not listen yet."""

AT_START = 0.1
"""m: a run whose bones are all within this of their places at the start has just begun."""


class StartWhenVisible:
    """Resumes a paused source once the first page has drawn its start.

    Without a page it resumes after ``timeout`` s, or never if that is None. The first page that is
    opened then resets the source; later pages do not. `update` is called repeatedly by one thread,
    with the open pages and the time, s of a steady clock.
    """

    def __init__(self, source: Source, timeout: float | None) -> None:
        self._source, self._timeout = source, timeout
        self._begin: float | None = None
        self._ran_unseen = False
        self._next_reset = 0.0
        self._start: tuple[Scene, np.ndarray] | None = None
        """Positions of a scene's bones at its start, (n, 3) m."""
        self._rendering: threading.Thread | None = None
        self._is_drawn = False
        self.is_done = False

    def hides(self, frame: Frame) -> bool:
        """Whether a frame is of the run that no page has seen, and is not to be drawn."""
        return self._ran_unseen and not self.is_done and not self._is_at_start(frame)

    def update(self, clients: list[viser.ClientHandle], frame: Frame | None, now: float) -> None:
        """Resume the source once a page has drawn its start, or after the timeout without a page.
        Before that, reset it or request an image from a page.
        """
        if self.is_done:
            return
        self._begin = now if self._begin is None else self._begin
        if not clients:
            if (self._timeout is not None and now - self._begin >= self._timeout
                    and not self._ran_unseen):
                self._ran_unseen = self._source.pause(False)
        elif self._is_drawn:
            self.is_done = self._source.pause(False)
        elif frame is None:
            return
        elif self.hides(frame):
            if now >= self._next_reset:
                self._next_reset = now + RETRY
                self._source.pause(True)
                self._source.reset()
        elif not (self._rendering and self._rendering.is_alive()):
            self._rendering = threading.Thread(target=self._render, args=(clients[-1],),
                                               daemon=True)
            self._rendering.start()

    def _is_at_start(self, frame: Frame) -> bool:
        if self._start is None or self._start[0] is not frame.scene:
            self._start = frame.scene, np.array([
                placement.bone_pose(bone)[0] for placement in frame.scene.dolls
                for bone in placement.doll.bones])
        return bool(np.abs(frame.state.positions - self._start[1]).max() <= AT_START)

    def _render(self, client: viser.ClientHandle) -> None:
        """Wait for an image: a page renders it after it has drawn what it was sent before."""
        try:
            client.get_render(16, 16, timeout=RENDER_TIMEOUT)
        except (TimeoutError, RuntimeError):
            # The page was closed, or is in a background tab.
            return
        self._is_drawn = True
