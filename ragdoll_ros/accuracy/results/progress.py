"""A line on stderr that says how far a long piece of work has come."""
from __future__ import annotations

import sys
import time


class Progress:
    """Counts finished pieces of ``total`` weight; a bar on a terminal, else a line now and then."""

    WIDTH = 30
    QUIET = 15.0
    """s between lines where stderr is no terminal."""

    def __init__(self, total: float) -> None:
        self._total = max(total, 1e-9)
        self._done = 0.0
        self._began = self._said = time.monotonic()
        self._terminal = sys.stderr.isatty()

    def advance(self, weight: float, label: str) -> None:
        """Note that a piece of ``weight`` is done."""
        self._done += weight
        now = time.monotonic()
        if self._terminal:
            filled = round(self.WIDTH * self._share)
            bar = '#' * filled + '.' * (self.WIDTH - filled)
            sys.stderr.write(f'\r[{bar}] {self._text(now)} {label[:40]:40}')
            sys.stderr.flush()
        elif now - self._said > self.QUIET:
            self._said = now
            sys.stderr.write(f'{self._text(now)} {label}\n')
            sys.stderr.flush()

    def close(self) -> None:
        """End the line."""
        if self._terminal:
            sys.stderr.write('\n')

    @property
    def _share(self) -> float:
        return min(1.0, self._done / self._total)

    def _text(self, now: float) -> str:
        gone = now - self._began
        left = gone * (1 / self._share - 1) if self._share > 0.02 else None
        rest = '' if left is None else f', about {left:.0f} s left'
        return f'{self._share:4.0%} {gone:.0f} s{rest}'
