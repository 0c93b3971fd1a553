"""The arrow keys' pushes, for all that steer the doll.

You look at the doll's face, from +x along -x: Up is away from you, Down toward you, Left and
Right as you see it.
"""
from __future__ import annotations

from collections.abc import Iterable

from ..model.vectors import Vector

STRENGTH = 2000.0
"""N: of a push of which nothing else is said."""

LIFT = 0.0005
"""N upwards for each N of a push, as the article has it."""

DIRECTIONS: dict[str, Vector] = {
    'up': (-1.0, 0.0, LIFT), 'down': (1.0, 0.0, LIFT),
    'right': (0.0, 1.0, LIFT), 'left': (0.0, -1.0, LIFT)}
"""World axes (the article's keys)."""


def total(arrows: Iterable[str], strength: float = STRENGTH) -> Vector:
    """Sum of the forces of all these arrows, N, world axes; each pushes with ``strength`` N."""
    parts = [DIRECTIONS[arrow] for arrow in arrows]
    return tuple(strength * part for part in map(sum, zip(*parts, strict=True))) if parts else (
        0.0, 0.0, 0.0)


TAP = 0.025
"""s of simulated time that a tap pushes: a doll of 55 kg gets 0.9 m/s."""

REPEAT = 0.1
"""s within which a key comes again that a terminal repeats, at ten times a second or more, and
nobody taps twice; keys that come within it of each other are pressed together."""

FIRST = 0.7
"""s within which a terminal repeats a held key for the first time."""

STUCK = 2.0
"""s after which a key counts as let go even if its release was never told (a lost focus)."""

OPPOSITE = {'up': 'down', 'down': 'up', 'left': 'right', 'right': 'left'}


class Held:
    """Arrows that push at a time ``now``, s of any steady clock.

    A key that comes once is a tap; one that is repeated is held, until shortly after its last
    repeat. An arrow pressed while others push joins them, and they last as long as it does; it
    takes the place of its opposite. Where releases are told, a held key ends with them.
    """

    def __init__(self) -> None:
        self.tap = TAP
        """s of the clock that a tap pushes."""
        self._keys: list[str] = []
        self._last = ''
        self._came = self._until = 0.0
        self._exact = self._lasts = False

    def take(self, key: str, down: bool, now: float) -> None:
        """Enter an arrow that went down or up."""
        if not down:
            self._exact = True
            self._keys = [other for other in self._keys if other != key]
            self._until = now + STUCK if self._lasts else self._until
            return
        since, pushing = now - self._came, self.left(now) > 0
        again = key == self._last and key in self._keys and since <= FIRST
        self._lasts = again and (self._exact or since <= REPEAT)
        if not again:
            joined = self._keys if pushing or since <= REPEAT else []
            self._keys = [other for other in joined if other not in (key, OPPOSITE[key])] + [key]
        self._last, self._came = key, now
        self._until = now + (
            self.tap if not self._lasts else STUCK if self._exact else REPEAT)

    def at(self, now: float) -> list[str]:
        """Arrows that push."""
        return list(self._keys) if self.left(now) > 0 else []

    def left(self, now: float) -> float:
        """How long they push on if no key comes, s."""
        return max(0.0, self._until - now) if self._keys else 0.0


HOLD = 0.15
"""s after which a key that is still down is held: a tap on a key lasts 0.07 to 0.13 s."""

SILENCE = 0.5
"""s after which keys count as let go of which nothing more is told."""


class Pressed:
    """Arrows of a keyboard that tells which keys are down, again and again while any is.

    A key pushes for a tap as it goes down, and on from HOLD later until it is let go. ``now``: s
    of any steady clock.
    """

    def __init__(self) -> None:
        self._since: dict[str, float] = {}
        self._down: frozenset[str] = frozenset()
        self._told = 0.0

    def take(self, down: Iterable[str], now: float) -> bool:
        """Enter which arrows are down; whether one has gone down just now."""
        before, self._down, self._told = self._down, frozenset(down) & DIRECTIONS.keys(), now
        new = self._down - before
        self._since.update(dict.fromkeys(new, now))
        return bool(new)

    def held(self, now: float) -> list[str]:
        """Arrows that are held."""
        there = now - self._told <= SILENCE
        return [arrow for arrow in sorted(self._down) if there and now - self._since[arrow] >= HOLD]

    def at(self, now: float) -> list[str]:
        """Arrows that push."""
        tapped = [arrow for arrow, since in sorted(self._since.items()) if now - since < TAP]
        return sorted({*tapped, *self.held(now)})
