"""Times of messages: their values apply at their stamps, whatever the delay.

A body reaches what it was told within one tick. If one message arrives just before a tick and the
next just after one, a joint would stand still for a tick, turn at twice its rate in the next, and
hit with that speed. Values are therefore extrapolated, at their rates, from the stamp of the
message to that of the present state.
"""
from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ....model import rotation
from ....model.scene import SECOND
from ....physics.actions.body_motion import TIMEOUT

LONGEST = TIMEOUT / SECOND
"""s between a stamp and the present, or between two stamps, above which they say nothing: as long
as a motion goes on."""


class MessageTimes:
    """Times of the messages of each source. ``now()``: stamp of the present state, ns."""

    def __init__(self, now: Callable[[], int]) -> None:
        self._now = now
        self._last: dict[str, tuple[int, Mapping[str, float]]] = {}
        """Stamp, ns, and angles of the last message of joints, by source."""

    def lead(self, stamp: int) -> float:
        """Return the time, s, from a stamp, ns, to the present state. 0 if there is no stamp, or if
        it is more than LONGEST away, as that of another clock.
        """
        lead = (self._now() - stamp) / SECOND
        return lead if stamp and abs(lead) <= LONGEST else 0.0

    def rates(self, source: str, stamp: int, angles: Mapping[str, float],
              wraps: Mapping[str, bool]) -> dict[str, float]:
        """Return rates of the angles since the last message of a source, by their stamps, ns. Empty
        without a last message or its stamp, or unless this message is later by at most LONGEST.
        ``wraps``: whether a joint turns without limits, so that its angle may wrap.
        """
        before, last = self._last.get(source, (0, {}))
        self._last[source] = stamp, dict(angles)
        seconds = (stamp - before) / SECOND
        if not (before and 0 < seconds <= LONGEST):
            return {}
        return {name: _difference(angle, last[name], wraps.get(name, False)) / seconds
                for name, angle in angles.items() if name in last}


def _difference(angle: float, before: float, wraps: bool) -> float:
    if wraps and math.isfinite(angle - before):
        return math.remainder(angle - before, math.tau)
    return angle - before


def carried_on(pose: Sequence[float], twist: Sequence[float], seconds: float) -> list[float]:
    """Advance a pose (7,) by a twist (6,), both in the world frame, for ``seconds``."""
    if not seconds:
        return list(pose)
    turn = rotation.from_rotation_vector(seconds * np.asarray(twist[3:]))
    moved = np.add(pose[:3], seconds * np.asarray(twist[:3]))
    return [*moved.tolist(), *rotation.multiply(turn, np.asarray(pose[3:])).tolist()]
