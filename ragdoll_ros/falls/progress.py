"""A line on stderr that says how many falls are done, how fast, and how long the rest takes."""
from __future__ import annotations

import sys
import time

from .manifest import Manifest

QUIET = 15.0
"""s between lines where stderr is no terminal."""


class Progress:
    """Of a run of ``count`` falls."""

    def __init__(self, count: int) -> None:
        self._count, self._new = count, 0
        self._began = self._said = time.monotonic()
        self._terminal = sys.stderr.isatty()

    def tell(self, manifest: Manifest, new: int) -> None:
        """Note that ``new`` falls more are done."""
        self._new += new
        now = time.monotonic()
        if self._terminal:
            sys.stderr.write(f'\r{self._text(manifest, now):78}')
        elif now - self._said > QUIET:
            self._said = now
            sys.stderr.write(self._text(manifest, now) + '\n')
        sys.stderr.flush()

    def close(self) -> None:
        """End the line."""
        if self._terminal:
            sys.stderr.write('\n')

    @property
    def seconds(self) -> float:
        """Since the beginning."""
        return time.monotonic() - self._began

    def _text(self, manifest: Manifest, now: float) -> str:
        done, failed = manifest.done, len(manifest.failures)
        rate = self._new / max(now - self._began, 1e-9)
        left = f', {_duration((self._count - done) / rate)} left' if rate else ''
        return f'{done} of {self._count} falls, {rate:.1f} a second{left}, {failed} failed'


def _duration(seconds: float) -> str:
    minutes, hours = seconds / 60, seconds / 3600
    return (f'{seconds:.0f} s' if seconds < 100 else
            f'{minutes:.0f} min' if minutes < 100 else f'{hours:.1f} h')
