"""The Markdown page: what stands under each heading, every figure in it from the JSON."""
from __future__ import annotations

from ..cases.hard_cases import hard_cases
from ..parts.fainting_falls import falls_tables
from ..results.criteria import ROUNDING, criteria
from ..results.figures import Row, number
from ..results.markdown import Section, table
from . import contact_sections

MOTION_COLUMNS = (
    ('label', 'method', '{}'), ('cpu_s_per_s', 'CPU ms/s', 'ms'),
    ('position_worst_m', 'position m, worst', '{:.1e}'), ('position_rms_m', 'RMS', '{:.1e}'),
    ('angle_worst_rad', 'angle rad, worst', '{:.1e}'),
    ('energy_excess', 'energy excess', '{:.1e}'), ('momentum_drift', 'momentum drift', '{:.0e}'),
    ('angular_momentum_drift', 'angular m. drift', '{:.0e}'),
    ('joint_gap_m', 'joint gap m', '{:.0e}'))


def motion_tables(rows: list[Row]) -> list[str]:
    """A table for each motion whose truth is known."""
    blocks = []
    for motion in dict.fromkeys(row['motion'] for row in rows):
        own = [row for row in rows if row['motion'] == motion]
        sinking = (('sinking_m', 'sinking mm', 'mm'),) if 'sinking_m' in own[0] else ()
        apexes = ((key, key.replace('_', ' '), '%') for key in own[0] if key.startswith('apex'))
        blocks += [f'### {own[0]["title"]}', f'Truth: {own[0]["reference"]}.',
                   table(own, (*MOTION_COLUMNS, *sinking, *apexes))]
    return blocks


def ratio_table(rows: list[Row]) -> list[str]:
    """CPU times over those of the first method, class by class and of all."""
    methods = list(dict.fromkeys(row['method'] for row in rows))
    lines = [{'class': name, **{row['method']: row['ratio'] for row in rows
                                if row['class'] == name}}
             for name in dict.fromkeys(row['class'] for row in rows)]
    sums = {method: sum(number(row['cpu_s']) for row in rows if row['method'] == method)
            for method in methods}
    lines.append({'class': 'all', **{method: sums[method] / sums[methods[0]]
                                     for method in methods}})
    return [table(lines, (('class', 'class', '{}'),
                          *((method, method, '{:.2f}') for method in methods)))]


def hard_table(rows: list[Row]) -> list[str]:
    """All cases, ours, with what PyBullet at N = 10 makes of them; why one fails."""
    others = {row['case']: 'yes' if row['passed'] else ', '.join(row['faults'])
              for row in rows if row['method'] == 'bullet-10'}
    shown = [{**row, 'other': others.get(row['case'])} for row in rows
             if row['method'] != 'bullet-10']
    known = {case.name: case.reason for case in hard_cases()}
    reasons = [f'- **{row["case"]}** fails: {known.get(row["case"]) or "no reason found yet"}'
               for row in shown if not row['passed']]
    return [table(shown, (
        ('case', 'case', '{}'), ('passed', 'holds', '{}'), ('faults', 'what does not', '{}'),
        ('excess', 'energy excess', '{:.1e}'), ('overshoot_rad', 'overshoot °', 'deg'),
        ('sinking_m', 'sinking mm', 'mm'), ('depth_m', 'bone in bone mm', 'mm'),
        ('gap_m', 'gap m', '{:.0e}'), ('fastest_m_s', 'fastest m/s', '{:.1f}'),
        ('end_m_s', 'at the end m/s', '{:.3f}'),
        ('other', 'PyBullet N = 10', '{}'))), *filter(None, ['\n'.join(reasons)])]


HARD = Section('hard', 'Hard cases, at normal', body=hard_table)

SECTIONS = (
    Section('energy', 'Energy over time',
            above=(('energy', 'A spun doll: energy over time'),
                   ('drop', 'The default drop: energy over time'))),
    Section('precision', 'Motions whose truth is known',
            'Lower left is better. Dashed: the front, which nothing beats in both. An error below '
            f'{ROUNDING:g} m or rad, which is rounding, counts as none there: no method is nearer.',
            body=motion_tables,
            above=(('precision', 'Error over CPU time for every motion'),)),
    Section('orders', 'Orders',
            'Slope of the error over the tick, by least squares on the logarithms; ours with one '
            'setting, and a flight step of one tick.', (
                ('title', 'motion', '{}'), ('label', 'method', '{}'), ('theory', 'theory', '{}'),
                ('order', 'measured', '{:.2f}'), ('order_finest', 'between the finest', '{:.2f}'),
                ('points', 'points', '{}')),
            below=(('orders', 'Error over the tick'),)),
    contact_sections.RESTITUTION, contact_sections.CONVERGENCE,
    contact_sections.PIECES,
    contact_sections.DROPS, contact_sections.COLLISIONS,
    Section('classes', 'Nine classes of starts',
            'Energy excess is the largest rise of E - work above its running minimum, over '
            'max(E0 + work); over 1e-5 counts as bad. What starts outside its limits counts from '
            'when it is back. Restless: not asleep 15 s later.', (
                ('class', 'class', '{}'), ('method', 'method', '{}'), ('starts', 'starts', '{}'),
                ('bad', 'bad', '{}'), ('worst_excess', 'worst excess', '{:.1e}'),
                ('worst_start', 'its number', '{}'), ('worst_overshoot_rad', 'overshoot °', 'deg'),
                ('worst_sinking_m', 'sinking mm', 'mm'), ('worst_depth_m', 'bone in bone mm', 'mm'),
                ('worst_gap_m', 'gap m', '{:.0e}'), ('worst_speed_m_s', 'fastest m/s', '{:.0f}'),
                ('settled', 'settled in time', '{}'), ('restless', 'restless', '{}')),
            above=(('classes', 'Worst energy excess'),)),
    Section('ratios', 'CPU against PyBullet at N = 10',
            'The same starts in turn, in one process.', body=ratio_table),
    HARD,
    Section('costs', 'A scene that needs less costs less', 'The default doll at normal.', (
        ('scene', 'scene', '{}'), ('tick_s', 'tick µs, median', 'us'),
        ('tick_p99_s', 'p99', 'us'))),
    Section('real_time', 'The default drop in real time, 3 s', columns=(
        ('label', 'method', '{}'), ('cpu_s_per_s', 'CPU ms/s', 'ms'), ('p50_s', 'tick µs', 'us'),
        ('p99_s', 'p99', 'us'), ('worst_s', 'worst', 'us'),
        ('over_budget', 'ticks over budget', '{:.1%}'))),
    Section('estimate', 'The live error estimate',
            'The error one tick of flight adds, estimated while it runs, against the truth.', (
                ('label', 'setting', '{}'), ('ticks', 'ticks', '{}'),
                ('rounding', 'left out, at rounding', '{}'),
                ('within_3', 'within a factor 3', '{:.0%}'),
                ('distrusted', 'ticks it does not trust', '{}')),
            below=(('estimate', 'Estimated over true error'),)),
    Section('swing', 'Swings, 3 s at several frame rates',
            'Worst errors of a damped spring let go at 60°, a pendulum let go level, a throw; '
            "beside them the period of the usual recipe (VRM's spring bones), which is another at "
            'each frame rate.', (
                ('rate', 'frames a second', '{}'), ('spring_error', 'spring rad', '{:.1e}'),
                ('pendulum_error', 'pendulum rad', '{:.1e}'), ('fall_error', 'throw m', '{:.1e}'),
                ('spring_frame_s', 'frame µs', 'us'),
                ('recipe_period_s', 'period by the recipe s', '{:.2f}'))),
    Section('faints', 'Faints beside real falls',
            'People stand, lean by up to 5° in any direction, and go limp part by part in any '
            'order: what comes of it without a muscle. Real people try to stay up and put their '
            'hands out: [what that means](people.md#beside-real-falls).', body=falls_tables,
            below=(('faints', 'Speeds at impact, and time to it'),
                   ('faint_directions', 'Speeds at impact by direction'))))


def markdown(data: dict, pictures: dict[str, str]) -> str:
    """The page for what the JSON holds; parts without figures are left out.

    ``pictures`` are the files of pictures by their names.
    """
    figures = data['figures']
    blocks = head(data['about'])
    promises = criteria(figures)
    if promises:
        blocks += ['## What was promised, what came out', table(promises, (
            ('goal', 'promise', '{}'), ('wanted', 'wanted', '{}'), ('found', 'found', '{}'),
            ('held', 'held', '{}')))]
    for section in SECTIONS:
        if figures.get(section.part):
            blocks += section.blocks(figures[section.part], pictures)
    return '\n\n'.join(blocks) + '\n'


def head(about: dict) -> list[str]:
    """What was run, where, when."""
    versions = ', '.join(f'{name} {version}' for name, version in about['versions'].items())
    return ['# Speed against error', f"""\
Written by `{about['command']}`{' (quick)' if about['quick'] else ''} on {about['date']} in \
{about['seconds']:.0f} s; every figure stands in `accuracy.json`.
Machine: {about['machine']}, {about['cores']} cores, {about['system']}. Python {about['python']}; \
{versions}.
{f"Our settings are those of the engine {about['engine']}." if 'engine' in about else ''}""",
            """\
CPU times are of the whole tick as Python sees it, reading all poses included, measured one after \
another in one process. On motions whose truth is known each tick counts with the median of its \
runs; where CPU is compared with PyBullet's, and where a scene needs less, with the least of its \
runs: what others take of a busy machine is no cost of a method. Compare ratios, not times. N is \
the number of substeps in a tick of 10 ms."""]
