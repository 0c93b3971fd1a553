"""Plots of fainting falls, compared with real falls."""
from __future__ import annotations

import numpy as np

from ...people.real_falls import DESCENT, IMPACT_SPEEDS, Known
from ..parts.fainting_falls import joined
from ..results.figures import Figures, sound

BLUE, ORANGE = '#1f5fbf', '#e69f00'


def draw_fainting_falls(figures: Figures, plt: object) -> object:
    """Histograms of impact speeds and descent times; bands: mean and SD of real falls."""
    rows = sound(figures.get('faints', ()))
    if not rows:
        return None
    values = joined(rows)
    figure, grid = plt.subplots(1, 4, figsize=(14, 3.2), layout='constrained')
    shown = [(part, f'{part}: vertical speed at impact, m/s', known)
             for part, known in IMPACT_SPEEDS.items()]
    shown.append(('descent', 'descent: onset to impact of the pelvis, s', DESCENT))
    for axes, (key, text, known) in zip(grid, shown, strict=True):
        own = values[key][np.isfinite(values[key])]
        axes.hist(own, bins=30, color=BLUE, alpha=0.8, label=f'simulated: {len(own)}')
        _band(axes.axvspan, axes.axvline, known)
        axes.set(xlabel=text, ylabel='falls')
        axes.legend(fontsize=8)
    return figure


def draw_fall_directions(figures: Figures, plt: object) -> object:
    """Impact speeds over the direction of the lean."""
    rows = sound(figures.get('faints', ()))
    if not rows:
        return None
    values = joined(rows)
    figure, grid = plt.subplots(1, 3, figsize=(12, 3.2), layout='constrained', sharex=True)
    for axes, (part, known) in zip(grid, IMPACT_SPEEDS.items(), strict=True):
        axes.plot(np.degrees(values['towards']), values[part], '.', color=BLUE, ms=3)
        _band(axes.axhspan, axes.axhline, known)
        axes.set(xlabel='lean, degrees from forwards to the left', title=part,
                 ylabel='vertical speed at impact, m/s', xticks=range(-180, 181, 90))
    return figure


def _band(span: object, line: object, known: Known) -> None:
    span(known.mean - known.deviation, known.mean + known.deviation, color=ORANGE, alpha=0.25,
         label='real falls, ± 1 SD')
    line(known.mean, color=ORANGE)
