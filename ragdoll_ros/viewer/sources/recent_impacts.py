"""Arrows of impacts that are drawn for a while after them."""
from __future__ import annotations

from collections.abc import Iterable

from ...physics.sensors.impact_arrow import ImpactArrow

LIFETIME = 1.0
"""s of simulated time."""

MOST = 200
"""Arrows that are kept, the newest."""


class RecentImpacts:
    """The arrows of the last LIFETIME s of a run."""

    def __init__(self) -> None:
        self._run = 0
        self._arrows: list[tuple[float, ImpactArrow]] = []
        """Times, s, and arrows."""

    def add(self, run: int, time: float, arrows: Iterable[ImpactArrow]) -> tuple[ImpactArrow, ...]:
        """Add the ``arrows`` of a tick that ends at ``time`` s, once. Returns all that are to be
        drawn then; another ``run`` begins anew.
        """
        if run != self._run:
            self._run, self._arrows = run, []
        self._arrows += [each for each in ((time, arrow) for arrow in arrows)
                         if each not in self._arrows]
        self._arrows = [(since, arrow) for since, arrow in self._arrows
                        if time - LIFETIME < since <= time][-MOST:]
        return tuple(arrow for _, arrow in self._arrows)
