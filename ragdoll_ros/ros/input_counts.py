"""Counts of what was refused and clamped."""
from __future__ import annotations

from collections import Counter

from rclpy.impl.rcutils_logger import RcutilsLogger

WARNING_PERIOD = 1.0
"""s between two warnings at the least."""


class Tally:
    """How often each input was refused or clamped, and why the last time.

    Every case is counted; the log gets one warning a second at the most.
    """

    def __init__(self, logger: RcutilsLogger) -> None:
        self.refused: Counter[str] = Counter()
        self.clamped: Counter[str] = Counter()
        self.reason = ''
        """Why the last one was refused or clamped."""
        self._logger = logger

    def refuse(self, source: str, reason: object) -> None:
        """Count an input that was not taken."""
        self.refused[source] += 1
        self._tell(f'{source} refused: {reason}')

    def clamp(self, source: str, reason: object) -> None:
        """Count an input that was taken in part."""
        self.clamped[source] += 1
        self._tell(f'{source} clamped: {reason}')

    def _tell(self, text: str) -> None:
        self.reason = text
        self._logger.warning(text, throttle_duration_sec=WARNING_PERIOD)
