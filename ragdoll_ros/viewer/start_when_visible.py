"""The first fall waits until somebody sees it."""
from __future__ import annotations

import threading

import viser

from .sources.source import Source

PATIENCE = 5.0
"""s that a page may take for one picture, before it is asked anew."""


class Opening:
    """Lets a source that stands at its start go once a page has drawn it.

    Without a page it goes after ``longest`` s, or not at all where that is None. `look` is called
    again and again, by one thread, with the pages that are open and the time, s of a steady clock.
    """

    def __init__(self, source: Source, longest: float | None) -> None:
        self._source, self._longest = source, longest
        self._begin: float | None = None
        self._asking: threading.Thread | None = None
        self._drawn = False
        self.is_over = False

    def look(self, clients: list[viser.ClientHandle], shown: bool, now: float) -> None:
        """Ask a page for a picture once it was sent one to draw, or let the source go."""
        if self.is_over:
            return
        self._begin = now if self._begin is None else self._begin
        alone = not clients and self._longest is not None and now - self._begin >= self._longest
        if self._drawn or alone:
            self.is_over = self._source.pause(False)
        elif clients and shown and (self._asking is None or not self._asking.is_alive()):
            self._asking = threading.Thread(target=self._ask, args=(clients[-1],), daemon=True)
            self._asking.start()

    def _ask(self, client: viser.ClientHandle) -> None:
        """Learn that a page draws: it sends pictures only after all that it was sent before."""
        try:
            client.get_render(16, 16, timeout=PATIENCE)
        except (TimeoutError, RuntimeError):
            # It has gone, or is in a tab behind others.
            return
        self._drawn = True
