"""Arrow keys as pushes, for the teleop and the page.

You look at the doll's face, from +x along -x: Up is away from you, Down toward you, Left and
Right as you see it.
"""
from __future__ import annotations

from collections.abc import Iterable

from ..model.vectors import Vector

FORCE = 2000.0
"""N: default force of a push."""

ARTICLE = 'article'
"""Name of the scene whose keys have the article's directions and push for as long as held."""

LIFT = 0.0005
"""Upward force relative to the push, from the article."""

DIRECTIONS: dict[str, Vector] = {
    'up': (-1.0, 0.0, LIFT), 'down': (1.0, 0.0, LIFT),
    'right': (0.0, 1.0, LIFT), 'left': (0.0, -1.0, LIFT)}
"""Direction of each key's push, world frame (the article's keys)."""


def total_force(arrows: Iterable[str], force: float = FORCE) -> Vector:
    """Sum of the pushes of these keys, N, world frame; each pushes with ``force`` N."""
    parts = [DIRECTIONS[arrow] for arrow in arrows]
    return tuple(force * sum(part[axis] for part in parts) for axis in range(3))


TAP = 0.025
"""s of simulated time that a tap pushes; gives a doll of 55 kg 0.9 m/s."""

REPEAT_PERIOD = 0.1
"""s: longest period of a terminal's key repeat, and shorter than two taps; keys that come within it
of each other are pressed together."""

REPEAT_DELAY = 0.7
"""s: longest delay until a terminal repeats a held key."""

RELEASE_TIMEOUT = 2.0
"""s after which a key counts as released even if no release was reported (a lost focus)."""

OPPOSITE = {'up': 'down', 'down': 'up', 'left': 'right', 'right': 'left'}


class HeldKeys:
    """Active arrow keys of a terminal, from key events without (or with) releases.

    A key event that comes once is a tap; a repeated key is held until shortly after its last
    repeat. A key pressed while others push joins them, and all push until the new key ends; a key
    replaces its opposite. Where releases are reported, a held key ends with its release. ``now`` is
    the time of a steady clock, s.
    """

    def __init__(self) -> None:
        self.tap = TAP
        """Duration of a tap, s of the clock."""
        self._keys: list[str] = []
        self._last = ''
        self._last_time = self._until = 0.0
        self._has_releases = self._is_held = False

    def on_key(self, key: str, down: bool, now: float) -> None:
        """Handle an arrow key that went down or up."""
        if not down:
            self._has_releases = True
            self._keys = [other for other in self._keys if other != key]
            self._until = now + RELEASE_TIMEOUT if self._is_held else self._until
            return
        since, pushing = now - self._last_time, self.remaining(now) > 0
        is_repeat = key == self._last and key in self._keys and since <= REPEAT_DELAY
        self._is_held = is_repeat and (self._has_releases or since <= REPEAT_PERIOD)
        if not is_repeat:
            joined = self._keys if pushing or since <= REPEAT_PERIOD else []
            self._keys = [other for other in joined if other not in (key, OPPOSITE[key])] + [key]
        self._last, self._last_time = key, now
        self._until = now + (self.tap if not self._is_held else RELEASE_TIMEOUT
                             if self._has_releases else REPEAT_PERIOD)

    @property
    def is_held(self) -> bool:
        """Whether the last key repeats, so that it is no tap."""
        return self._is_held

    def active(self, now: float) -> list[str]:
        """Keys that push."""
        return list(self._keys) if self.remaining(now) > 0 else []

    def remaining(self, now: float) -> float:
        """Time, s, until the keys stop pushing without another key event."""
        return max(0.0, self._until - now) if self._keys else 0.0


HOLD_DELAY = 0.15
"""s after which a key that is still down is held: a tap lasts 0.07 to 0.13 s."""

REPORT_TIMEOUT = 0.5
"""s without a report after which all keys count as released."""


class PressedKeys:
    """Active arrow keys of a keyboard that reports repeatedly which keys are down.

    A key pushes for the duration of a tap (TAP) when it goes down, and again from HOLD_DELAY later
    until its release. ``now`` is the time of a steady clock, s.
    """

    def __init__(self) -> None:
        self._since: dict[str, float] = {}
        self._down: frozenset[str] = frozenset()
        self._last_report = 0.0

    def report(self, down: Iterable[str], now: float) -> bool:
        """Report which keys are down. Returns whether one has just gone down."""
        before, self._down, self._last_report = self._down, frozenset(down) & DIRECTIONS.keys(), now
        new = self._down - before
        self._since.update(dict.fromkeys(new, now))
        return bool(new)

    def held(self, now: float) -> list[str]:
        """Keys that are held."""
        is_current = now - self._last_report <= REPORT_TIMEOUT
        return [arrow for arrow in sorted(self._down)
                if is_current and now - self._since[arrow] >= HOLD_DELAY]

    def active(self, now: float) -> list[str]:
        """Keys that push."""
        tapped = [arrow for arrow, since in sorted(self._since.items()) if now - since < TAP]
        return sorted({*tapped, *self.held(now)})
