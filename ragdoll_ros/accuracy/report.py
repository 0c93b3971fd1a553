"""The Markdown page: every figure in it comes from the JSON."""
from __future__ import annotations

from collections.abc import Callable, Sequence

from . import hard
from .goals import goals, number
from .tables import table

Row = dict[str, object]
Figures = dict[str, list[Row]]
Pictures = dict[str, str]


def markdown(data: dict, pictures: Pictures) -> str:
    """Write the page from what the JSON holds; parts without figures are left out."""
    figures = data['figures']
    parts = [head(data['about']), promises(figures)]
    for section in SECTIONS:
        text = section(figures, pictures)
        if text:
            parts.append(text)
    return '\n'.join(parts)


def head(about: dict) -> str:
    """What was run, where, when."""
    versions = ', '.join(f'{name} {version}' for name, version in about['versions'].items())
    return f"""# Speed against error

Written by `{about['command']}`{' (quick)' if about['quick'] else ''} on {about['date']} in \
{about['seconds']:.0f} s; every figure stands in `accuracy.json`.
Machine: {about['machine']}, {about['cores']} cores, {about['system']}. Python {about['python']}; \
{versions}.
The sums of our ticks are {'compiled by numba' if about.get('compiled') else 'not compiled'}.

CPU times are of the whole tick as Python sees it, reading all poses included: medians, measured \
one after another in one process. Compare ratios, not times. N is the number of substeps in a tick \
of 10 ms.
"""


def promises(figures: Figures) -> str:
    """What was promised and what came out."""
    rows = goals(figures)
    if not rows:
        return ''
    return '## What was promised, what came out\n\n' + table(rows, (
        ('goal', 'promise', '{}'), ('wanted', 'wanted', '{}'), ('found', 'found', '{}'),
        ('held', 'held', '{}')))


def energy(figures: Figures, pictures: Pictures) -> str:
    """Energy over time."""
    if 'energy' not in figures:
        return ''
    return ('## Energy over time\n' + _picture(pictures, 'energy', 'A spun doll: energy over time')
            + _picture(pictures, 'drop', 'The default drop: energy over time'))


def precision(figures: Figures, pictures: Pictures) -> str:
    """Motions with a truth."""
    rows = [row for row in figures.get('precision', ()) if 'failed' not in row]
    if not rows:
        return _failed(figures, 'precision')
    text = ('## Motions whose truth is known\n\nLower left is better. Dashed: the front, which '
            'nothing beats in both.\n'
            + _picture(pictures, 'precision', 'Error over CPU time for every motion'))
    for motion in dict.fromkeys(row['motion'] for row in rows):
        own = [row for row in rows if row['motion'] == motion]
        extra = [key for key in own[0] if key.startswith('apex')]
        text += f'\n### {own[0]["title"]}\n\nTruth: {own[0]["reference"]}.\n\n' + table(own, (
            ('label', 'method', '{}'), ('cpu_s_per_s', 'CPU ms/s', 'ms'),
            ('position_worst_m', 'position m, worst', '{:.1e}'),
            ('position_rms_m', 'RMS', '{:.1e}'),
            ('angle_worst_rad', 'angle rad, worst', '{:.1e}'),
            ('energy_excess', 'energy excess', '{:.1e}'),
            ('momentum_drift', 'momentum drift', '{:.0e}'),
            ('angular_momentum_drift', 'angular m. drift', '{:.0e}'),
            ('joint_gap_m', 'joint gap m', '{:.0e}'),
            *((('sinking_m', 'sinking mm', 'mm'),) if 'sinking_m' in own[0] else ()),
            *((key, key.replace('_', ' '), '%') for key in extra)))
    return text


def orders(figures: Figures, pictures: Pictures) -> str:
    """Orders table."""
    if 'orders' not in figures:
        return ''
    return ('## Orders\n\nSlope of the error over the tick, by least squares on the logarithms; '
            'ours with one setting, and a flight step of one tick.\n\n' + table(figures['orders'], (
                ('title', 'motion', '{}'), ('label', 'method', '{}'), ('theory', 'theory', '{}'),
                ('order', 'measured', '{:.2f}'), ('order_finest', 'between the finest', '{:.2f}'),
                ('points', 'points', '{}')))
            + _picture(pictures, 'orders', 'Error over the tick'))


def pieces(figures: Figures, pictures: Pictures) -> str:
    """Pieces through contacts."""
    if 'pieces' not in figures:
        return ''
    return ('## Through contacts: short pieces from a reference\n\n0.1 s each, begun at instants '
            'of a fine run of the default drop, against the same engine at N = 128 (after Erez, '
            'Tassa and Todorov, ICRA 2015).\n\n' + table(figures['pieces'], (
                ('label', 'method', '{}'), ('cpu_s_per_s', 'CPU ms/s', 'ms'),
                ('position_median_m', 'position mm, median', 'mm'),
                ('position_p90_m', '90 %', 'mm'), ('angle_median_rad', 'angle °, median', 'deg'),
                ('gap_worst_m', 'worst joint gap m', '{:.0e}'),
                ('sinking_worst_m', 'worst sinking mm', 'mm')))
            + _picture(pictures, 'pieces', 'Error over CPU time through contacts'))


def spread(figures: Figures, pictures: Pictures) -> str:
    """The default drop as a cloud."""
    if 'spread' not in figures:
        return ''
    rows = []
    for row in figures['spread']:
        row = dict(row)
        for key in ('height_m', 'way_m', 'energy_left_1s'):
            if f'{key}_mean' in row:
                row[key] = f'{number(row[f"{key}_mean"]):.3f} ± {number(row[f"{key}_sd"]):.3f}'
        rows.append(row)
    count = rows[0].get('starts', '')
    return (f'## The default drop, {count} starts tilted by thousandths of a radian\n\nThe path '
            'is chaotic; the cloud is not. The first row stands for the truth of its engine.\n\n'
            + table(rows, (('label', 'method', '{}'), ('height_m', 'height at the end m', '{}'),
                           ('way_m', 'way m', '{}'),
                           ('energy_left_1s', 'share of energy left at 1 s', '{}'),
                           ('settled', 'settled within 5 s', '{}'),
                           ('settled_s_median', 'median settle time s', '{:.2f}'))))


def classes(figures: Figures, pictures: Pictures) -> str:
    """Nine classes of starts."""
    if 'classes' not in figures:
        return ''
    return ('## Nine classes of starts\n\nEnergy excess is max(E - E0 - work) / max(E0 + work); '
            'over 0.1 % counts as bad.\n' + _picture(pictures, 'classes', 'Worst energy excess')
            + '\n' + table(figures['classes'], (
                ('class', 'class', '{}'), ('method', 'method', '{}'), ('starts', 'starts', '{}'),
                ('bad', 'bad', '{}'), ('worst_excess', 'worst excess', '{:.1e}'),
                ('worst_start', 'its number', '{}'),
                ('worst_overshoot_rad', 'overshoot °', 'deg'),
                ('worst_sinking_m', 'sinking mm', 'mm'), ('worst_gap_m', 'gap m', '{:.0e}'),
                ('worst_speed_m_s', 'fastest m/s', '{:.0f}'),
                ('settled', 'settled in time', '{}'))))


def ratios(figures: Figures, pictures: Pictures) -> str:
    """CPU against fixed substeps."""
    rows = [row for row in figures.get('ratios', ()) if 'failed' not in row]
    if not rows:
        return _failed(figures, 'ratios')
    methods = list(dict.fromkeys(row['method'] for row in rows))
    base = sum(number(row['cpu_s']) for row in rows if row['method'] == methods[0])
    lines = []
    for name in [*dict.fromkeys(row['class'] for row in rows), 'all']:
        line: Row = {'class': name}
        for method in methods:
            own = [row for row in rows if row['method'] == method]
            line[method] = (sum(number(row['cpu_s']) for row in own) / base if name == 'all' else
                            next(row['ratio'] for row in own if row['class'] == name))
        lines.append(line)
    return ('## CPU against PyBullet at N = 10\n\nThe same starts in turn, in one process.\n\n'
            + table(lines, (('class', 'class', '{}'),
                            *((method, method, '{:.2f}') for method in methods))))


def switches(figures: Figures, pictures: Pictures) -> str:
    """The mechanisms one by one."""
    rows = [row for row in figures.get('switches', ()) if 'failed' not in row]
    if not rows:
        return _failed(figures, 'switches')
    lines = []
    base = sum(number(row['cpu_s']) for row in rows if row['method'] == 'all on')
    for method in dict.fromkeys(row['method'] for row in rows):
        own = [row for row in rows if row['method'] == method]
        worst = max(own, key=lambda row: number(row['worst_excess']))
        inside = [row for row in own if row['class'] != 'start outside']
        lines.append({
            'method': method, 'starts': sum(row['starts'] for row in own),
            'bad': sum(row['bad'] for row in own), 'excess': worst['worst_excess'],
            'class': worst['class'] if number(worst['worst_excess']) > 1e-3 else '',
            'overshoot': max(number(row['worst_overshoot_rad']) for row in inside),
            'sinking': max(number(row['worst_sinking_m']) for row in own),
            'cpu': sum(number(row['cpu_s']) for row in own) / base})
    text = '## The mechanisms one by one\n\nThe setting normal with one thing switched off.\n\n'
    text += table(lines, (
        ('method', 'switched off', '{}'), ('starts', 'starts', '{}'), ('bad', 'bad', '{}'),
        ('excess', 'worst excess', '{:.1e}'), ('class', 'in', '{}'),
        ('overshoot', 'overshoot ° (without starts outside)', 'deg'),
        ('sinking', 'sinking mm', 'mm'), ('cpu', 'CPU, all on = 1', '{:.2f}')))
    return text + '\n### Class by class\n\n' + table(rows, (
        ('class', 'class', '{}'), ('method', 'switched off', '{}'), ('bad', 'bad', '{}'),
        ('worst_excess', 'worst excess', '{:.1e}'), ('worst_overshoot_rad', 'overshoot °', 'deg'),
        ('worst_sinking_m', 'sinking mm', 'mm'), ('cpu_s', 'CPU s', '{:.2f}')))


def projection(figures: Figures, pictures: Pictures) -> str:
    """The price of corrections."""
    if 'projection' not in figures:
        return ''
    return ('## The price of keeping energy and momentum\n\nWhat the corrections cost in time, '
            'and what they change in the error, each motion at each setting. In the air they are '
            'for what the engine steps; without Runge-Kutta it steps all. What slides or rolls is '
            'moved by the mean of its velocities (centred).\n\n'
            + table(figures['projection'], (
                ('motion', 'motion', '{}'), ('accuracy', 'setting', '{}'),
                ('switched', 'switched off', '{}'), ('cpu_s_per_s', 'CPU ms/s', 'ms'),
                ('position_worst_m', 'position m', '{:.2e}'),
                ('angle_worst_rad', 'angle rad', '{:.2e}'),
                ('energy_excess', 'energy excess', '{:.1e}'),
                ('momentum_drift', 'momentum drift', '{:.0e}'),
                ('angular_momentum_drift', 'angular m. drift', '{:.0e}'))))


def costs(figures: Figures, pictures: Pictures) -> str:
    """What a scene costs."""
    if 'costs' not in figures:
        return ''
    return ('## A scene that needs less costs less\n\nThe default doll at normal.\n\n'
            + table(figures['costs'], (('scene', 'scene', '{}'),
                                       ('tick_s', 'tick µs, median', 'us'),
                                       ('tick_p99_s', 'p99', 'us'))))


def real_time(figures: Figures, pictures: Pictures) -> str:
    """Ticks of the default drop."""
    if 'real_time' not in figures:
        return ''
    return ('## The default drop in real time, 3 s\n\n' + table(figures['real_time'], (
        ('label', 'method', '{}'), ('cpu_s_per_s', 'CPU ms/s', 'ms'), ('p50_s', 'tick µs', 'us'),
        ('p99_s', 'p99', 'us'), ('worst_s', 'worst', 'us'),
        ('over_budget', 'ticks over budget', '{:.1%}'))))


def estimate(figures: Figures, pictures: Pictures) -> str:
    """The live estimate."""
    if 'estimate' not in figures:
        return ''
    rows = figures['estimate']
    if all(row.get('missing') for row in rows):
        return '## The live error estimate\n\nThis version has none.\n'
    return ('## The live error estimate\n\nThe error one tick of flight adds, estimated while it '
            'runs, against the truth.\n\n' + table(rows, (
                ('label', 'setting', '{}'), ('ticks', 'ticks', '{}'),
                ('within_3', 'within a factor 3', '{:.0%}'),
                ('distrusted', 'ticks it does not trust', '{}')))
            + _picture(pictures, 'estimate', 'Estimated over true error'))


def swing(figures: Figures, pictures: Pictures) -> str:
    """Swings at several frame rates."""
    if 'swing' not in figures:
        return ''
    return ('## Swings, 3 s at several frame rates\n\nWorst errors of a damped spring let go at '
            '60°, a pendulum let go level, a throw; beside them the period of the usual recipe '
            "(VRM's spring bones), which is another at each frame rate.\n\n"
            + table(figures['swing'], (
                ('rate', 'frames a second', '{}'), ('spring_error', 'spring rad', '{:.1e}'),
                ('pendulum_error', 'pendulum rad', '{:.1e}'), ('fall_error', 'throw m', '{:.1e}'),
                ('spring_frame_s', 'frame µs', 'us'),
                ('recipe_period_s', 'period by the recipe s', '{:.2f}'))))


def hard_cases(figures: Figures, pictures: Pictures) -> str:
    """Hard cases."""
    if 'hard' not in figures:
        return ''
    return '## Hard cases, at normal\n\n' + hard.section(figures['hard'])


SECTIONS: tuple[Callable[[Figures, Pictures], str], ...] = (
    energy, precision, orders, pieces, spread, classes, ratios, switches, projection, hard_cases,
    costs, real_time, estimate, swing)


def _picture(pictures: Pictures, name: str, text: str) -> str:
    return f'\n![{text}]({pictures[name]})\n' if name in pictures else ''


def _failed(figures: Figures, part: str) -> str:
    """Show jobs that failed where nothing else is left."""
    rows: Sequence[Row] = figures.get(part, ())
    return f'## {part}\n\n' + table(rows, (('job', 'job', '{}'),)) if rows else ''
