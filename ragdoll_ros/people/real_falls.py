"""Measurements of people's real falls, as published: references for simulated falls."""
from __future__ import annotations

from dataclasses import dataclass

CHOI = 'Choi et al. 2015 (10.1016/j.jbiomech.2015.02.025), 25 falls'
KOMISAR = 'Komisar et al. 2022 (10.1186/s12877-022-03041-3), 2388 falls'


@dataclass(frozen=True)
class Known:
    """A published mean, its standard deviation and its source."""

    mean: float
    deviation: float
    source: str


IMPACT_SPEEDS = {'pelvis': Known(2.14, 0.63, CHOI), 'head': Known(2.91, 0.86, CHOI),
                 'hand': Known(2.87, 1.60, CHOI)}
"""Vertical speed, m/s, of each body part at its impact on the ground."""

DESCENT = Known(0.583, 0.255, CHOI)
"""Descent time, s: from the onset of the fall to the impact of the pelvis."""

SHARE_THAT_HITS = {'pelvis': (0.95, KOMISAR), 'head': (0.35, KOMISAR)}
"""Share of falls in which a body part hits the ground, and the source."""

BONES = {'pelvis': ('pelvis', 'lower_trunk', 'trunk', 'torso'), 'head': ('head',),
         'hand': ('hand', 'forearm')}
"""Suffixes of the bone names that represent a body part, the preferred one first."""


def bones_of(part: str, names: list[str]) -> list[int]:
    """Indices in ``names`` of the bones that represent a body part; empty if none does."""
    for suffix in BONES[part]:
        found = [index for index, name in enumerate(names) if name.endswith(suffix)]
        if found:
            return found
    return []
