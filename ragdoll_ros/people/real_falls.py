"""Measurements of people's real falls, as published: references for simulated falls."""
from dataclasses import dataclass

CHOI = 'Choi et al. 2015 (10.1016/j.jbiomech.2015.02.025), 25 falls'
KOMISAR = 'Komisar et al. 2022 (10.1186/s12877-022-03041-3), 2388 falls'


@dataclass(frozen=True)
class Known:
    """A published mean, its standard deviation and its source."""

    mean: float
    deviation: float
    source: str


@dataclass(frozen=True)
class KnownRange:
    """A published range and its source."""

    low: float
    high: float
    source: str


IMPACT_SPEEDS = {'pelvis': Known(2.14, 0.63, CHOI), 'head': Known(2.91, 0.86, CHOI),
                 'hand': Known(2.87, 1.60, CHOI)}
"""Vertical speed, m/s, of each body part at its impact on the ground."""

DESCENT = Known(0.583, 0.255, CHOI)
"""Descent time, s: from the onset of the fall to the impact of the pelvis."""

SHARE_THAT_HITS = {'pelvis': (0.95, KOMISAR), 'head': (0.35, KOMISAR)}
"""Share of falls in which a body part hits the ground, and the source."""

SHARE_TOLERANCE = 0.1
"""Difference between two shares of falls above which they are told apart: twice the standard
deviation of a share of 0.35 in a hundred falls."""

WAIST_PEAK = KnownRange(3.8, 8.1, 'SisFall (10.3390/s17010198), '
                        'onto landing mats: medians of its 15 kinds of falls')
"""g: largest acceleration of a sensor at the waist at 100 Hz, as docs/sisfall_peaks.py measures it
in the 1798 falls of SisFall's files."""

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
