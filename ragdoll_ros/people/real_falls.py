"""What was measured of people's real falls, as published: to hold simulated ones against."""
from __future__ import annotations

from dataclasses import dataclass

CHOI = 'Choi et al. 2015 (10.1016/j.jbiomech.2015.02.025), 25 falls'
KOMISAR = 'Komisar et al. 2022 (10.1186/s12877-022-03041-3), 2388 falls'


@dataclass(frozen=True)
class Known:
    """A mean, its standard deviation, and whose."""

    mean: float
    deviation: float
    source: str


IMPACT_SPEEDS = {'pelvis': Known(2.14, 0.63, CHOI), 'head': Known(2.91, 0.86, CHOI),
                 'hand': Known(2.87, 1.60, CHOI)}
"""Vertical speed, m/s, at which parts hit the ground."""

DESCENT = Known(0.583, 0.255, CHOI)
"""From the fall's onset to the pelvis' impact, s."""

SHARE_THAT_HITS = {'pelvis': (0.95, KOMISAR), 'head': (0.35, KOMISAR)}
"""Share of falls in which a part hits the ground, and whose."""
