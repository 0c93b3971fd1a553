"""A picture of the timeline: when something pushed, when something touched the ground."""
from __future__ import annotations

import numpy as np

from .frame_buffer import Cut

WIDTH = 300
"""Columns: about the panel's width in pixels."""

RED, YELLOW, GREY = '#e63219', '#f5be00', '#868e96'
"""As arrows and contacts are drawn; where the time begins anew."""

TRACK = '<rect width="{width}" height="6" y="{top}" fill="#868e9633"/>'


def strip(cut: Cut) -> str:
    """SVG of WIDTH columns: pushes and hands above, the ground below, resets as lines."""
    share = (cut.times - cut.times[0]) / max(cut.duration, 1e-9)
    columns = np.minimum((share * WIDTH).astype(int), WIDTH - 1)
    rows = [TRACK.format(width=WIDTH, top=top) for top in (0, 8)]
    for flags, top, color in ((cut.pushed, 0, RED), (cut.touching, 8, YELLOW)):
        rows += [f'<rect x="{first}" y="{top}" width="{last - first}" height="6" fill="{color}"/>'
                 for first, last in _runs(np.unique(columns[flags]))]
    rows += [f'<rect x="{column}" width="1" height="14" fill="{GREY}"/>'
             for column in np.unique(columns[cut.begins])]
    return (f'<svg viewBox="0 0 {WIDTH} 14" preserveAspectRatio="none" role="img" '
            'aria-label="red: pushes; yellow: on the ground; grey: reset" '
            'style="display:block;width:calc(100% - 1.5em);height:14px;margin:0 0.75em 0.5em">'
            f'<title>red: pushes and hands; yellow: on the ground; grey: a reset</title>'
            f'{"".join(rows)}</svg>')


def _runs(columns: np.ndarray) -> list[tuple[int, int]]:
    """First columns of runs without a gap, and the ones after their last."""
    if not len(columns):
        return []
    ends = np.flatnonzero(np.diff(columns) > 1)
    firsts = columns[np.concatenate([[0], ends + 1])]
    lasts = columns[np.concatenate([ends, [len(columns) - 1]])] + 1
    return list(zip(firsts.tolist(), lasts.tolist(), strict=True))
