"""Plots of contacts: errors over step size, and distributions of drops."""
from __future__ import annotations

import math

import numpy as np

from ..results.figures import Figures, number, sound

STYLES = {'core': ('#1f5fbf', 'D'), 'PyBullet': ('#e69f00', 'o'),
          'MuJoCo implicitfast': ('#4f9d69', '^')}
"""Colour and marker of each engine."""

COLUMNS = 4


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


def draw_drops(figures: Figures, plt: object) -> object:
    """Cumulative distributions of random drops by each method; black: the reference."""
    rows = [row for row in sound(figures.get('drops', ())) if row['population'] == 'random']
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
