"""What is known of real falls: what a data set is shown beside."""
from __future__ import annotations

from dataclasses import dataclass

CHOI = 'Choi 2015 (10.1016/j.jbiomech.2015.02.025), 25 falls'
KOMISAR = 'Komisar 2022 (10.1186/s12877-022-03041-3), 2388 falls'


@dataclass(frozen=True)
class Known:
    """A mean and its standard deviation, and whose."""

    mean: float
    deviation: float
    source: str


IMPACT_SPEEDS = {'pelvis': Known(2.14, 0.63, CHOI), 'head': Known(2.91, 0.86, CHOI),
                 'hand': Known(2.87, 1.60, CHOI)}
"""Vertical speed, m/s, at which parts hit the ground."""

DESCENT = Known(0.583, 0.255, CHOI)
"""From onset to impact, s."""

SHARE_THAT_HITS = {'pelvis': (0.95, KOMISAR), 'head': (0.35, KOMISAR)}
"""Share of falls in which a part hits the ground."""

BONES = {'pelvis': ('pelvis', 'lower_trunk', 'trunk', 'torso'), 'head': ('head',),
         'hand': ('hand', 'forearm')}
"""Ends of the names of bones that stand for a part, the best first."""


def bones_of(part: str, names: list[str]) -> list[int]:
    """Indices of the bones that stand for a part; none where no name tells."""
    for word in BONES[part]:
        found = [index for index, name in enumerate(names) if name.endswith(word)]
        if found:
            return found
    return []
