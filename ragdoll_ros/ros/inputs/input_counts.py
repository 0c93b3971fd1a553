"""Counters of refused and clamped input."""
from __future__ import annotations

import contextlib
import math
import time
from collections import Counter
from collections.abc import Iterator

from rclpy.impl.rcutils_logger import RcutilsLogger

from ...model.errors import ModelError

WARNING_PERIOD = 1.0
"""s: throttle of the warnings."""


class InputCounts:
    """Counts refused and clamped inputs by source; logs a throttled warning for each."""

    def __init__(self, logger: RcutilsLogger) -> None:
        self.refused: Counter[str] = Counter()
        self.clamped: Counter[str] = Counter()
        self.last_reason = ''
        """Why the last input was refused or clamped."""
        self._last_time = math.nan
        self._logger = logger

    @property
    def last_reason_age(self) -> float:
        """Wall time since the last input was refused or clamped, s; NaN if none was."""
        return time.monotonic() - self._last_time

    def refuse(self, source: str, reason: object) -> None:
        """Count an input that was ignored."""
        self.refused[source] += 1
        self._warn(f'{source} refused: {reason}')

    @contextlib.contextmanager
    def refusing(self, source: str) -> Iterator[None]:
        """Context manager: refuse and count the input if its handling raises a ModelError."""
        try:
            yield
        except ModelError as error:
            self.refuse(source, error)

    def clamp(self, source: str, reason: object) -> None:
        """Count an input that was limited."""
        self.clamped[source] += 1
        self._warn(f'{source} clamped: {reason}')

    def _warn(self, text: str) -> None:
        self.last_reason, self._last_time = text, time.monotonic()
        self._logger.warning(text, throttle_duration_sec=WARNING_PERIOD)
