"""Plots of the report, drawn from its JSON alone."""
from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..results.criteria import EXCESS
from ..results.figures import Figures, Row, number, sound
from ..results.laws import law_name
from .contact_plots import draw_convergence, draw_drops, draw_fainting_falls, draw_fall_directions

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BLUE, RED, ORANGE, GREY = '#1f5fbf', '#c8321e', '#e69f00', '#8a8a8a'
COLOURS = {'ours': BLUE, 'quickstart': RED, 'PyBullet': ORANGE, 'MuJoCo euler': '#9ac7a4',
           'MuJoCo implicitfast': '#4f9d69', 'MuJoCo rk4': '#12532c', 'DART': '#8e5ea2',
           'Drake': '#6b4f3a'}
MARKS = {'ours': 'D', 'quickstart': 'X', 'PyBullet': 'o', 'MuJoCo euler': 'v',
         'MuJoCo implicitfast': '^', 'MuJoCo rk4': 's', 'DART': 'p', 'Drake': 'h'}
SMALLEST = 1e-16
"""Where errors of zero are drawn."""

LINE = 0.06
"""Height of a line of text as a share of the axis."""

CPU_RANGE = (4e-4, 1.5)
"""CPU s per simulated s in all plots."""

AXIS_LABELS = {'position_worst_m': 'largest position error, m',
               'angle_worst_rad': 'largest angle error, rad',
               'position_median_m': 'position error within 0.1 s, median, m'}


def draw_all(figures: Figures, folder: Path) -> dict[str, str]:
    """Draw every plot that has figures into a folder; returns files by the plots' names."""
    import matplotlib
    matplotlib.use('Agg')
    import matplotlib.pyplot as plt
    plt.rcParams.update({'font.size': 10, 'axes.spines.top': False, 'axes.spines.right': False,
                         'figure.dpi': 110, 'axes.titlesize': 11, 'legend.frameon': False})
    made = {}
    for name, draw in (('energy', draw_energy), ('precision', draw_precision),
                       ('pieces', draw_segments), ('drop', draw_drop), ('classes', draw_classes),
                       ('compared', functools.partial(draw_classes, part='compared')),
                       ('orders', draw_orders), ('estimate', draw_estimate),
                       ('convergence', draw_convergence), ('drops', draw_drops),
                       ('faints', draw_fainting_falls), ('faint_directions', draw_fall_directions)):
        figure = draw(figures, plt)
        if figure is None:
            continue
        made[name] = f'accuracy_{name}.png'
        figure.savefig(folder / made[name], bbox_inches='tight')
        plt.close(figure)
    return made


def draw_energy(figures: Figures, plt: object) -> object:
    """The README's picture: energy over time of a spinning doll without contacts."""
    rows = _by_method(figures.get('energy', ()), scene='spin')
    if len(rows) < 3:
        return None
    figure, axes = plt.subplots(figsize=(7.5, 4.2))
    axes.axhline(1.0, color='black', lw=1, ls=':')
    lines = (('bullet-1', RED, 'PyBullet, 10 ms steps:\nenergy gain'),
             ('quickstart', ORANGE, 'PyBullet as in its quickstart:\ndefault damping'),
             ('ours-normal', BLUE, 'ragdoll_ros'))
    top = 2.2
    for method, colour, text in lines:
        row = rows[method]
        energy = [number(value) for value in row['energy']]
        axes.plot(row['time_s'], energy, color=colour, lw=3 if 'ours' in method else 2)
        index = next((i for i, value in enumerate(energy) if not value < top), None)
        if index is not None:
            axes.annotate(text, (row['time_s'][index] + 0.1, top * 0.93), color=colour, va='top',
                          fontsize=12, fontweight='bold')
            continue
        offset = 0.05 if 'ours' in method else -0.05
        axes.annotate(text, (row['time_s'][-1], energy[-1] + offset), color=colour, ha='right',
                      va='bottom' if offset > 0 else 'top', fontsize=12, fontweight='bold')
    axes.set(ylim=(0, top), xlim=(0, rows['ours-normal']['time_s'][-1]), xlabel='time, s',
             ylabel='energy / energy at the start')
    axes.set_title('A spinning doll without contacts and damping: its energy must stay constant.',
                   loc='left')
    return figure


def draw_drop(figures: Figures, plt: object) -> object:
    """Energy of the default drop over time."""
    rows = _by_method(figures.get('energy', ()), scene='drop')
    if not rows:
        return None
    figure, axes = plt.subplots(figsize=(7.5, 3.6))
    for method, colour in (('bullet-1', ORANGE), ('quickstart', RED), ('ours-normal', BLUE)):
        row = rows[method]
        axes.plot(row['time_s'], [number(value) for value in row['energy']], color=colour, lw=2,
                  label=row['label'] + (', 10 ms' if method == 'bullet-1' else ''))
    axes.axvline(0.2857, color=GREY, lw=1, ls=':')
    axes.annotate('first contact', (0.2857, 0.03), color=GREY, xytext=(4, 0),
                  textcoords='offset points')
    axes.set(xlabel='time, s', ylabel='energy / energy at the start', ylim=(0, None),
             xlim=(0, row['time_s'][-1]))
    axes.set_title('The default drop: energy is constant before the first contact, then decreases',
                   loc='left')
    axes.legend()
    return figure


def draw_precision(figures: Figures, plt: object) -> object:
    """Work-precision plots: error over CPU time for every motion."""
    rows = sound(figures.get('precision', ()))
    names = list(dict.fromkeys(row['motion'] for row in rows))
    if not names:
        return None
    columns = 3
    lines = math.ceil(len(names) / columns)
    figure, grid = plt.subplots(lines, columns, figsize=(13, 3.5 * lines), squeeze=False,
                                layout='constrained')
    for axes, name in zip(grid.flat, names, strict=False):
        own = [row for row in rows if row['motion'] == name]
        _work_precision(axes, own, own[0]['yardstick'])
        axes.set_title(own[0]['title'], loc='left', fontsize=10)
    for axes in grid.flat[len(names):]:
        axes.set_visible(False)
    handles, labels = grid.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc='outside lower center', ncols=6)
    return figure


def draw_segments(figures: Figures, plt: object) -> object:
    """Work-precision plot of short segments through contacts."""
    rows = [row for row in sound(figures.get('pieces', ())) if 'reference' in row]
    if not rows:
        return None
    laws = list(dict.fromkeys(map(law_name, rows)))
    figure, grid = plt.subplots(1, len(laws), figsize=(7.5 * len(laws), 4.2), squeeze=False,
                                sharey=True, layout='constrained')
    for axes, law in zip(grid.flat, laws, strict=True):
        _work_precision(axes, [row for row in rows if law_name(row) == law], 'position_median_m')
        axes.set_title(law or 'Segments of 0.1 s through contacts, against one reference',
                       loc='left')
        axes.legend(fontsize=9)
    return figure


def draw_classes(figures: Figures, plt: object, part: str = 'classes') -> object:
    """Largest energy gain in each class of starts, by the methods of a part."""
    rows = sound(figures.get(part, ()))
    classes = list(dict.fromkeys(row['class'] for row in rows))
    shown = (('ours-draft', '#9dbbe8', 'ours draft'), ('ours-normal', BLUE, 'ours normal'),
             ('ours-exact', '#0c2d66', 'ours exact'), ('bullet-10', ORANGE, 'PyBullet N = 10'),
             ('bullet-20', '#f3d38a', 'PyBullet N = 20'),
             ('mujoco-implicitfast-10', '#4f9d69', 'MuJoCo implicitfast N = 10'),
             ('dart-10', '#8e5ea2', 'DART N = 10'))
    shown = [entry for entry in shown if entry[0] in {row['method'] for row in rows}]
    if not rows:
        return None
    figure, axes = plt.subplots(figsize=(11, 4.2))
    width = 0.8 / len(shown)
    low, high = 1e-9, 1e2
    for place, (method, colour, label) in enumerate(shown):
        found = {row['class']: number(row['worst_excess']) for row in rows
                 if row['method'] == method}
        heights = [min(high, max(low, found.get(name, 0.0))) for name in classes]
        shift = (place - len(shown) / 2 + 0.5) * width
        positions = [index + shift for index in range(len(classes))]
        axes.bar(positions, heights, width, color=colour, label=label)
    axes.axhline(EXCESS, color='black', lw=1)
    axes.annotate(f'bound: {EXCESS:g}', (-0.45, 1.15 * EXCESS), va='bottom', fontsize=9)
    axes.set(yscale='log', ylim=(low, high), xlim=(-0.5, len(classes) - 0.5),
             ylabel='largest relative energy excess')
    axes.set_xticks(range(len(classes)), classes, rotation=20, ha='right')
    axes.set_title('Energy gain: the largest of all starts of each class '
                   '(no bar: below 1e-9)', loc='left')
    axes.legend(ncols=3, fontsize=9, loc='upper left')
    return figure


ROUND_TICKS = (1, 2, 5, 10, 20, 50, 100, 200)
"""Labels of the tick axis, ms."""


def draw_orders(figures: Figures, plt: object) -> object:
    """Error over the tick."""
    rows = sound(figures.get('orders', ()))
    names = list(dict.fromkeys(row['motion'] for row in rows))
    if not names:
        return None
    figure, grid = plt.subplots(1, len(names), figsize=(4.6 * len(names), 3.8), squeeze=False,
                                layout='constrained')
    styles = {'ours-draft': ('#9dbbe8', 'D'), 'ours-normal': (BLUE, 'D'),
              'ours-exact': ('#0c2d66', 'D')}
    for axes, name in zip(grid.flat, names, strict=True):
        for row in rows:
            if row['motion'] != name:
                continue
            family = row['label'].split(' N =')[0]
            colour, mark = styles.get(row['method'],
                                      (COLOURS.get(family, GREY), MARKS.get(family, 'o')))
            order = row['order']
            text = f'{family}: {order:.2f}' if order is not None else family
            axes.loglog([1e3 * tick for tick in row['ticks_s']],
                        [number(error) or math.nan for error in row['errors']],
                        marker=mark, color=colour, ms=5, label=text)
        axes.set(xlabel='tick, ms', ylabel='largest error, m or rad', xlim=(1, 300))
        axes.set_xticks(ROUND_TICKS, [f'{tick:g}' for tick in ROUND_TICKS])
        axes.minorticks_off()
        axes.set_title(rows[[r['motion'] for r in rows].index(name)]['title'], loc='left',
                       fontsize=10)
        axes.legend(fontsize=7, title='measured order', title_fontsize=8)
    return figure


def draw_estimate(figures: Figures, plt: object) -> object:
    """Estimated over true local error, tick by tick."""
    rows = [row for row in figures.get('estimate', ()) if row.get('true')]
    if not rows:
        return None
    figure, axes = plt.subplots(figsize=(5.2, 5.0))
    for row, colour in zip(rows, ('#9dbbe8', BLUE, '#0c2d66'), strict=False):
        axes.loglog(row['true'], row['estimated'], '.', ms=4, color=colour, label=row['label'])
    low, high = axes.get_xlim()
    for factor, style in ((1, '-'), (3, ':'), (1 / 3, ':')):
        axes.plot((low, high), (factor * low, factor * high), color=GREY, lw=1, ls=style)
    axes.set(xlabel='true error of a tick, m', ylabel='estimated, m')
    axes.set_title('Local error estimate in flight; dotted: a factor of 3', loc='left')
    axes.legend()
    return figure


def _work_precision(axes: Axes, rows: Sequence[Row], error_key: str) -> None:
    """A work-precision plot: a line for each family, the Pareto front, the real-time line."""
    points = [(row['family'], number(row['cpu_s_per_s']), number(row[error_key])) for row in rows]
    points = [(family, x, max(y, SMALLEST)) for family, x, y in points
              if math.isfinite(y) and y < 1e3]
    for family in COLOURS:
        own = sorted((x, y) for name, x, y in points if name == family)
        if own:
            big = family in ('ours', 'quickstart')
            axes.plot(*zip(*own, strict=True), marker=MARKS[family], color=COLOURS[family],
                      ms=8 if big else 4, lw=1.5 if family == 'ours' else 1,
                      zorder=3 if big else 2, label=family)
    front = _front([(x, y) for _, x, y in points])
    axes.step(*zip(*front, strict=True), where='post', color='black', lw=0.7, ls='--', zorder=1,
              label='Pareto front')
    axes.set(xscale='log', yscale='log', xlim=CPU_RANGE, xlabel='CPU s per simulated s',
             ylabel=AXIS_LABELS[error_key])
    _name_settings(axes, [row for row in rows if row['family'] == 'ours'], error_key)
    axes.grid(True, which='major', lw=0.3)
    axes.axvline(1.0, color=RED, lw=1)
    axes.annotate('real time', (1.0, 0.02), xycoords=('data', 'axes fraction'), color=RED,
                  fontsize=8, ha='right', va='bottom', rotation=90)


def _name_settings(axes: Axes, rows: Sequence[Row], error_key: str) -> None:
    """Label the accuracies' points; neighbours of nearly equal height share one label."""
    low, high = np.log10(axes.get_ylim())
    groups: list[list[tuple[float, float, str]]] = []
    for row in rows:
        height = math.log10(max(number(row[error_key]), SMALLEST))
        point = (number(row['cpu_s_per_s']), height, row['label'].removeprefix('ours '))
        if groups and abs(groups[-1][0][1] - height) < LINE * (high - low):
            groups[-1].append(point)
        else:
            groups.append([point])
    for group in groups:
        places, heights, names = zip(*group, strict=True)
        axes.annotate(', '.join(names), (max(places), 10 ** float(np.mean(heights))), fontsize=7,
                      xytext=(7, 0), textcoords='offset points', va='center', color=BLUE)


def _front(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Pareto front: the points (x, y) that no other dominates."""
    kept: list[tuple[float, float]] = []
    for x, y in sorted(points):
        if not kept or y < kept[-1][1]:
            kept.append((x, y))
    return kept


def _by_method(rows: Sequence[Row], scene: str) -> dict[str, Row]:
    return {row['method']: row for row in rows if row.get('scene') == scene}
