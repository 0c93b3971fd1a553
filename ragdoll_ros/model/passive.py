"""Passive elastic torque on a joint angle, as of stretched tissue: a double exponential.

torque = lower.torque exp((lower.angle - q) / lower.width)
       - upper.torque exp((q - upper.angle) / upper.width)

The form of Yoon and Mansour (J Biomech 1982), and of Anderson's coefficients in Falisse et al. (J R
Soc Interface 2019, 16:20190402), without terms of adjacent joints; so it has a potential.
"""
from __future__ import annotations

import math
from dataclasses import dataclass

from . import errors
from .errors import set_fields

STEEPEST = 40.0
"""Exponent, at most: 2e17 times the torque at the end, beyond any joint limit."""


@dataclass(frozen=True)
class PassiveEnd:
    """One end of the range: the torque is ``torque`` N m at ``angle`` rad, and grows by a factor of
    e for each ``width`` rad beyond.

    Angle and width are rounded to 1e-9 degrees. Raises NotFinite, NotPositive.
    """

    torque: float
    angle: float
    width: float

    def __post_init__(self) -> None:
        errors.check_finite('passive', (self.torque, self.angle, self.width))
        for key in ('torque', 'width'):
            if getattr(self, key) <= 0:
                raise errors.NotPositive(key, getattr(self, key), 'above zero')
        set_fields(self, torque=float(self.torque), **{
            key: math.radians(round(math.degrees(getattr(self, key)), 9))
            for key in ('angle', 'width')})

    def growth(self, distance: float) -> float:
        """Ratio of the torque ``distance`` rad beyond the end to the torque at the end; its
        exponent is at most STEEPEST.
        """
        return math.exp(min(distance / self.width, STEEPEST))


@dataclass(frozen=True)
class Passive:
    """Passive torque on one joint angle; see the module."""

    lower: PassiveEnd
    upper: PassiveEnd

    def torque(self, angle: float) -> float:
        """Torque, N m, at an angle, rad; positive where it increases the angle."""
        low, high = self._growths(angle)
        return self.lower.torque * low - self.upper.torque * high

    def energy(self, angle: float) -> float:
        """Elastic energy, J; minus its derivative is the torque."""
        low, high = self._growths(angle)
        return (self.lower.torque * self.lower.width * low
                + self.upper.torque * self.upper.width * high)

    def _growths(self, angle: float) -> tuple[float, float]:
        return self.lower.growth(self.lower.angle - angle), self.upper.growth(
            angle - self.upper.angle)
