"""The limited joint angles of a scene: how far past their limits, and what presses against them."""
from __future__ import annotations

import math

import numpy as np

from ...model.coordinates import DofLayout, GeneralizedState

AT_LIMIT = 1e-3
"""rad: a joint as near as this to its limit, and moving toward it, is at the limit."""


class JointLimits:
    """What the limits of all k limited angles have to say."""

    def __init__(self, layout: DofLayout) -> None:
        self._layout = layout
        self.forget()

    def forget(self) -> None:
        """Begin anew."""
        self._held = np.zeros(len(self._layout.limits[0]), bool)
        """(k,) whether a flight ended at this limit and the joint has leaned on it since."""
        self._known: GeneralizedState | None = None
        """What was looked at last, with what was seen."""
        self._past = self._speeds = np.zeros(0)
        self._most = -math.inf

    def same(self, old: GeneralizedState, new: GeneralizedState) -> None:
        """Take note that the joints stand and move alike in both."""
        if self._known is old:
            self._known = new

    def max_violation(self, coordinates: GeneralizedState) -> float:
        """Angle, rad, by which the joint is past its limit that is so most; minus infinity: none.

        Negative: so far from it.
        """
        self._look(coordinates)
        return self._most

    def hold(self, coordinates: GeneralizedState) -> None:
        """Remember which joints are past their limits: until they leave, no flight begins."""
        self._look(coordinates)
        self._held |= self._past > 0

    def is_active(self, coordinates: GeneralizedState, duration: float) -> bool:
        """Whether a joint presses against its limit, or will within ``duration`` s."""
        self._look(coordinates)
        past, ahead = self._past, self._past + self._speeds * duration
        self._held &= past > -AT_LIMIT
        pressing = (past >= -AT_LIMIT) & (self._speeds > 0)
        return bool((self._held | pressing | (past > AT_LIMIT) | (ahead > AT_LIMIT)).any())

    def approach(self, coordinates: GeneralizedState, soon: float) -> float:
        """Fastest speed, rad/s, at which a joint moves that reaches its limit within ``soon`` s."""
        self._look(coordinates)
        near = self._speeds[self._past + soon * self._speeds > 0]
        return float(near.max(initial=0.0))

    def fastest(self, coordinates: GeneralizedState) -> float:
        """Fastest speed, rad/s, of a limited joint."""
        return float(np.abs(coordinates.v[self._layout.limited[1]]).max(initial=0.0))

    def _look(self, coordinates: GeneralizedState) -> None:
        if self._known is not coordinates:
            self._past = self._layout.past_limits(coordinates.q)
            self._speeds = self._layout.limit_speeds(coordinates)
            self._most = float(self._past.max(initial=-math.inf))
            self._known = coordinates
