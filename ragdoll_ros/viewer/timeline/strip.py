"""Event strip of the timeline: pushes, ground contact and resets over time."""
from __future__ import annotations

import numpy as np

from .frame_buffer import Clip

WIDTH = 300
"""Columns: about the width of the panel in pixels."""

RED, YELLOW, GREY = '#e63219', '#f5be00', '#868e96'
"""Colours of arrows, of contacts and of resets."""

TRACK = '<rect width="{width}" height="6" y="{top}" fill="#868e9633"/>'


def strip(clip: Clip) -> str:
    """SVG of WIDTH columns: pushes and hands above, ground contact below, resets as lines."""
    fraction = (clip.times - clip.times[0]) / max(clip.duration, 1e-9)
    columns = np.minimum((fraction * WIDTH).astype(int), WIDTH - 1)
    rows = [TRACK.format(width=WIDTH, top=top) for top in (0, 8)]
    for flags, top, color in ((clip.pushed, 0, RED), (clip.touching, 8, YELLOW)):
        rows += [f'<rect x="{first}" y="{top}" width="{last - first}" height="6" fill="{color}"/>'
                 for first, last in _runs(np.unique(columns[flags]))]
    rows += [f'<rect x="{column}" width="1" height="14" fill="{GREY}"/>'
             for column in np.unique(columns[clip.resets])]
    return (f'<svg viewBox="0 0 {WIDTH} 14" preserveAspectRatio="none" role="img" '
            'aria-label="red: pushes; yellow: on the ground; grey: reset" '
            'style="display:block;width:calc(100% - 1.5em);height:14px;margin:0 0.75em 0.5em">'
            f'<title>red: pushes and hands; yellow: on the ground; grey: a reset</title>'
            f'{"".join(rows)}</svg>')


def _runs(columns: np.ndarray) -> list[tuple[int, int]]:
    """Intervals [first, end) of consecutive columns."""
    if not len(columns):
        return []
    ends = np.flatnonzero(np.diff(columns) > 1)
    firsts = columns[np.concatenate([[0], ends + 1])]
    lasts = columns[np.concatenate([ends, [len(columns) - 1]])] + 1
    return list(zip(firsts.tolist(), lasts.tolist(), strict=True))
