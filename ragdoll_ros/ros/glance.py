"""When what can wait is to be looked at by an executor that wakes for each tick.

rclpy goes through all that a node has at each wake: the services and the misfits of topics, 37
here, cost more at each tick than all else that a doll takes which sleeps.
"""
from __future__ import annotations


class Glance:
    """Opens once in so many ns of the steady clock, ``patience``, and stays open for two wakes.

    An executor gathers what it waits for, wakes, and goes through what it has gathered; a timer
    that is ready, as one is that is always late, comes first. It is open both times then.
    """

    def __init__(self, patience: int) -> None:
        self._patience = patience
        self._left = 2
        self._next = 0

    @property
    def is_open(self) -> bool:
        """Whether it is time to look."""
        return self._left > 0

    def wake(self, now: int) -> None:
        """Count a wake of the timer, at ``now``."""
        self._left = max(0, self._left - 1)
        if not self._left and now >= self._next:
            self._left, self._next = 2, now + self._patience
