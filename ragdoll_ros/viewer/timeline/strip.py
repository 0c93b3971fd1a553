"""Event strip of the timeline: pushes, contacts and resets over time."""
from __future__ import annotations

import numpy as np

from .frame_buffer import Clip

WIDTH = 600
"""Columns: about the width of the bar in pixels."""

RED, YELLOW, GREY = '#e63219', '#f5be00', '#868e96'
"""Colours of arrows, of contacts and of resets."""

TRACK = '<rect width="{width}" height="6" y="{top}" fill="#868e9633"/>'


def strip(clip: Clip) -> str:
    """SVG of WIDTH columns: pushes and hands above, contacts below, resets as lines."""
    fraction = (clip.times - clip.times[0]) / max(clip.duration, 1e-9)
    columns = np.minimum((fraction * WIDTH).astype(int), WIDTH - 1)
    rows = [TRACK.format(width=WIDTH, top=top) for top in (0, 8)]
    for flags, top, color in ((clip.pushed, 0, RED), (clip.touching, 8, YELLOW)):
        rows += [f'<rect x="{first}" y="{top}" width="{end - first}" height="6" fill="{color}"/>'
                 for first, end in _runs(flags, columns)]
    rows += [f'<rect x="{column}" width="1" height="14" fill="{GREY}"/>'
             for column in np.unique(columns[clip.resets])]
    return (f'<svg viewBox="0 0 {WIDTH} 14" preserveAspectRatio="none" role="img" '
            'aria-label="red: pushes and hands; yellow: contacts; grey: a reset">'
            f'{"".join(rows)}</svg>')


def _runs(flags: np.ndarray, columns: np.ndarray) -> list[tuple[int, int]]:
    """Intervals [first, end) of columns of flagged frames, each of which lasts until the next."""
    changes = np.diff(np.concatenate([[0], flags.astype(int), [0]]))
    ends = np.append(columns, WIDTH)
    found: list[tuple[int, int]] = []
    for first, after in zip(np.flatnonzero(changes > 0), np.flatnonzero(changes < 0), strict=True):
        start, end = int(columns[first]), int(max(ends[after], columns[first] + 1))
        if found and start <= found[-1][1]:
            found[-1] = found[-1][0], max(end, found[-1][1])
        else:
            found.append((start, end))
    return found
