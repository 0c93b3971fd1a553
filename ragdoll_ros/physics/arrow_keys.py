"""The arrow keys' pushes, for all that steer the doll.

You look at the doll's face, from +x along -x: Up is away from you, Down toward you, Left and
Right as you see it.
"""
from __future__ import annotations

from collections.abc import Iterable

from ..model.vectors import Vector

FORCES: dict[str, Vector] = {
    'up': (-2000.0, 0.0, 1.0), 'down': (2000.0, 0.0, 1.0),
    'right': (0.0, 2000.0, 1.0), 'left': (0.0, -2000.0, 1.0)}
"""N, world axes (the article's keys)."""


def total(arrows: Iterable[str]) -> Vector:
    """Sum of the forces of all these arrows, N."""
    forces = [FORCES[arrow] for arrow in arrows]
    return tuple(map(sum, zip(*forces, strict=True))) if forces else (0.0, 0.0, 0.0)


FIRST = 0.6
"""s that a key counts as held after its first press: until a terminal begins to repeat it."""

REPEAT = 0.15
"""s that it counts as held after a repeat: a few repeats."""

STUCK = 2.0
"""s after which a key counts as let go even if its release was never told (a lost focus)."""

OPPOSITE = {'up': 'down', 'down': 'up', 'left': 'right', 'right': 'left'}


class Held:
    """Arrows that count as held at a time ``now``, s of any steady clock.

    An arrow pressed while others are held joins them, and they last as long as it does; it takes
    the place of its opposite. Where the terminal tells releases, these alone count.
    """

    def __init__(self) -> None:
        self._keys: list[str] = []
        self._last = ''
        self._until = 0.0
        self._exact = False

    def take(self, key: str, down: bool, now: float) -> None:
        """Enter an arrow that went down or up."""
        if not down:
            self._exact = True
            self._keys = [other for other in self._keys if other != key]
            self._until = now + STUCK
            return
        keys = self.at(now)
        again = key in keys and key == self._last
        self._keys = [other for other in keys if other not in (key, OPPOSITE[key])] + [key]
        self._last = key
        self._until = now + (STUCK if self._exact else REPEAT if again else FIRST)

    def at(self, now: float) -> list[str]:
        """Arrows held."""
        return list(self._keys) if now <= self._until else []
