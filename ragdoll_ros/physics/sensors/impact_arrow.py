"""An arrow for each impact, to be drawn along the impulse on the bone, with a text: the bone's
name, the force and its ratio to the limit.
"""
from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...model.vectors import Vector, vector

if TYPE_CHECKING:
    from .impacts import Impact

LENGTH_AT_LIMIT = 0.25
"""m: arrow of a force at its limit."""

SHORTEST, LONGEST = 0.1, 1.0
"""m: arrow of small forces and of those without a limit; of the largest."""

OF_LIMIT = re.compile(r'([0-9.]+) of the limit$')
"""The end of a text."""


@dataclass(frozen=True)
class ImpactArrow:
    """An arrow from the point of impact along the impulse, world frame, m."""

    tail: Vector
    tip: Vector
    text: str
    """Bone, peak force and ratio to the limit; of a bone without a region the impulse."""
    is_above: bool
    """Whether the force is above the limit."""

    @property
    def ratio(self) -> float:
        """Peak force over its limit, to the two decimals of the text; 0 without a limit."""
        found = OF_LIMIT.search(self.text)
        return float(found[1]) if found else 0.0

    @property
    def length(self) -> float:
        """Length, m."""
        return math.dist(self.tail, self.tip)


def impact_arrow(impact: Impact) -> ImpactArrow:
    """The arrow of an impact; its length is in proportion to the ratio, within bounds."""
    known = not math.isnan(impact.ratio)
    length = min(max(LENGTH_AT_LIMIT * impact.ratio, SHORTEST), LONGEST) if known else SHORTEST
    force = (f'{impact.peak_force:.0f} N, {impact.ratio:.2f} of the limit' if known
             else f'{impact.impulse:.3g} N s')
    tail = np.array(impact.point)
    return ImpactArrow(impact.point, vector(tail + length * np.array(impact.normal)),
                       f'{impact.bone}: {force}', known and impact.ratio > 1)
