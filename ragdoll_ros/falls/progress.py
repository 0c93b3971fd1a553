"""Progress of a run on stderr: falls done, falls per second, time left."""
from __future__ import annotations

import sys
import time

from .manifest import Manifest

LOG_INTERVAL = 15.0
"""s between lines if stderr is no terminal."""


class ProgressLine:
    """Progress of a run of ``count`` falls; on a terminal one line that is rewritten."""

    def __init__(self, count: int) -> None:
        self._count, self._new = count, 0
        self._began = self._printed = time.monotonic()
        self._terminal = sys.stderr.isatty()

    def update(self, manifest: Manifest, new: int) -> None:
        """Count ``new`` more falls and print."""
        self._new += new
        now = time.monotonic()
        if self._terminal:
            sys.stderr.write(f'\r{self._text(manifest, now):78}')
        elif now - self._printed > LOG_INTERVAL:
            self._printed = now
            sys.stderr.write(self._text(manifest, now) + '\n')
        sys.stderr.flush()

    def close(self) -> None:
        """End the line."""
        if self._terminal:
            sys.stderr.write('\n')

    @property
    def seconds(self) -> float:
        """Time since the beginning, s."""
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
