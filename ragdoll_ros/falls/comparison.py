"""Compare a data set with published figures of real falls."""
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..people.real_falls import (
    DESCENT,
    IMPACT_SPEEDS,
    SHARE_THAT_HITS,
    SHARE_TOLERANCE,
    WAIST_PEAK,
    Known,
    bones_of,
)
from .dataset_summary import DatasetSummary


@dataclass(frozen=True)
class PublishedComparison:
    """One figure of the data set beside that of real falls."""

    what: str
    ours: str
    published: str
    source: str
    outside: bool
    """Whether ours is outside the published range: mean and one standard deviation, a share and
    SHARE_TOLERANCE, or the lowest and the highest.
    """

    @property
    def row(self) -> str:
        """Row of a table in Markdown."""
        note = '**outside**' if self.outside else 'within'
        return f'| {self.what} | {self.ours} | {self.published} | {note} | {self.source} |'

    @property
    def warning(self) -> str:
        """The comparison as one line of text."""
        return f'{self.what}: {self.ours}; real falls: {self.published} ({self.source})'


def comparisons(summary: DatasetSummary) -> Iterator[PublishedComparison]:
    """Yield all comparisons that the data set allows: none for body parts that the doll lacks, and
    none at all for a recipe of the cause `no_fall`.
    """
    if not summary.recipe.falls:
        return
    yield from _spread('descent, s', 'pelvis', summary, summary.descents, DESCENT)
    for part, known in IMPACT_SPEEDS.items():
        yield from _spread(f'impact speed of the {part}, m/s', part, summary,
                           summary.speeds_of(part), known)
    for part, (share, source) in SHARE_THAT_HITS.items():
        if bones_of(part, summary.bones):
            own = summary.share_that_hits(part)
            yield PublishedComparison(f'{part} hits in', f'{own:.0%}', f'{share:.0%}', source,
                                      abs(own - share) > SHARE_TOLERANCE)
    own = [summary.bones[index] for index in bones_of('pelvis', summary.bones)]
    if summary.peaks.bone in own and np.isfinite(summary.peaks.largest).any():
        middle = float(np.nanmedian(summary.peaks.largest))
        yield PublishedComparison(
            f'peak acceleration at {summary.peaks.sensor}, g (median)', f'{middle:.1f}',
            f'{WAIST_PEAK.low:g} to {WAIST_PEAK.high:g}', WAIST_PEAK.source,
            not WAIST_PEAK.low <= middle <= WAIST_PEAK.high)


def spread(values: np.ndarray, digits: int = 2) -> str:
    """Mean and standard deviation of the values that are known."""
    values = values[np.isfinite(values)]
    if not len(values):
        return 'none'
    return f'{values.mean():.{digits}f} ± {values.std():.{digits}f}'


def _spread(what: str, part: str, summary: DatasetSummary, own: np.ndarray,
            known: Known) -> Iterator[PublishedComparison]:
    names = [summary.bones[index] for index in bones_of(part, summary.bones)]
    if names:
        yield PublishedComparison(
            f'{what} ({", ".join(names)})', spread(own),
            f'{known.mean:.2f} ± {known.deviation:.2f}', known.source,
            bool(len(own)) and bool(abs(own.mean() - known.mean) > known.deviation))
