"""Plots of contacts: errors over step size, distributions of drops, and fainting falls."""
import math

import numpy as np

from ...people.real_falls import DESCENT, IMPACT_SPEEDS, Known
from ..parts.fainting_falls import joined
from ..results.figures import Figures, number, sound

STYLES = {'core': ('#1f5fbf', 'D'), 'PyBullet': ('#e69f00', 'o'),
          'MuJoCo implicitfast': ('#4f9d69', '^')}
"""Colour and marker of each engine."""

COLUMNS = 4

BLUE, ORANGE = '#1f5fbf', '#e69f00'


def draw_convergence(figures: Figures, plt: object) -> object:
    """Error over step size for each motion; dotted: order 1."""
    rows = sound(figures.get('convergence', ()))
    names = list(dict.fromkeys(row['motion'] for row in rows))
    if not names:
        return None
    lines = math.ceil(len(names) / COLUMNS)
    figure, grid = plt.subplots(lines, COLUMNS, figsize=(14, 2.9 * lines), squeeze=False,
                                layout='constrained')
    for axes in grid.flat[len(names):]:
        axes.set_visible(False)
    for axes, name in zip(grid.flat, names, strict=False):
        own = [row for row in rows if row['motion'] == name]
        for row in own:
            colour, mark = STYLES[row['label']]
            axes.loglog([1e3 * step for step in row['steps_s']],
                        [max(number(error), 1e-16) for error in row['errors']], marker=mark,
                        color=colour, ms=4, lw=1.2, label=row['label'])
        top = max(axes.get_ylim()[1], 1e-3)
        axes.loglog((0.01, 10), (top * 1e-3, top), color='grey', lw=0.8, ls=':')
        axes.set_title(own[0]['title'], loc='left', fontsize=8)
        axes.set_ylabel('m' if own[0]['yardstick'].startswith('position') else 'rad')
    for axes in grid[-1]:
        axes.set_xlabel('step, ms')
    figure.legend(*grid.flat[0].get_legend_handles_labels(), loc='outside lower center', ncols=3)
    return figure


QUANTITIES = (('energy_0.5s', 'relative energy at 0.5 s'), ('energy_1s', 'at 1 s'),
          ('slide_m', 'slide, m'), ('settled_s', 'settling time, s'))


RANDOM = ('random', 'random, e = 0.5')
"""Populations that are drawn; the first is that of older versions."""


def draw_drops(figures: Figures, plt: object) -> object:
    """Cumulative distributions of random drops by each method; black: the reference."""
    rows = [row for row in sound(figures.get('drops', ())) if row['population'] in RANDOM]
    if not rows:
        return None
    figure, grid = plt.subplots(1, len(QUANTITIES), figsize=(14, 3.4), layout='constrained')
    for axes, (key, text) in zip(grid, QUANTITIES, strict=True):
        for index, row in enumerate(rows):
            values = np.sort([number(value) for value in row['values'][key]])
            values = values[np.isfinite(values)]
            shares = np.arange(1, len(values) + 1) / len(row['values'][key])
            axes.step(values, shares, where='post', lw=2.0 if index == 0 else 1.0,
                      color='black' if index == 0 else None, label=row['label'])
        axes.set(xlabel=text, ylim=(0, 1))
    grid[0].set_ylabel('share of drops below')
    figure.legend(*grid[0].get_legend_handles_labels(), loc='outside lower center', ncols=4)
    return figure


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
