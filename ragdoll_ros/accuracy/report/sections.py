"""The Markdown page: its sections, with every figure from the JSON."""
from ..cases.hard_cases import hard_cases
from ..parts.fainting_falls import falls_tables
from ..results.criteria import ROUNDING, criteria
from ..results.figures import Row, number
from ..results.laws import law_note, motion_law_note
from ..results.markdown import Section, present, table
from . import contact_sections
from .law_choices import LAW_CHOICES

MOTION_COLUMNS = (
    ('label', 'method', '{}'), ('cpu_s_per_s', 'CPU ms/s', 'ms'),
    ('reading_s_per_s', 'reading ms/s', 'ms'),
    ('position_worst_m', 'position m, largest', '{:.1e}'), ('position_rms_m', 'RMS', '{:.1e}'),
    ('angle_worst_rad', 'angle rad, largest', '{:.1e}'),
    ('energy_excess', 'energy excess', '{:.1e}'), ('momentum_drift', 'momentum drift', '{:.0e}'),
    ('angular_momentum_drift', 'angular m. drift', '{:.0e}'),
    ('joint_gap_m', 'joint gap m', '{:.0e}'))


def motion_tables(rows: list[Row]) -> list[str]:
    """A table for each reference motion."""
    blocks = []
    for motion in dict.fromkeys(row['motion'] for row in rows):
        own = [row for row in rows if row['motion'] == motion]
        sinking = (('sinking_m', 'penetration mm', 'mm'),) if 'sinking_m' in own[0] else ()
        apexes = ((key, key.replace('_', ' '), '%') for key in own[0] if key.startswith('apex'))
        blocks += [f'### {own[0]["title"]}', f'Reference: {own[0]["reference"]}.',
                   table(own, present(own, (*MOTION_COLUMNS, *sinking, *apexes)))]
    return blocks


def ratio_table(rows: list[Row]) -> list[str]:
    """CPU times over those of the first method, by class and in total, and the times of reading
    over the same total.
    """
    methods = list(dict.fromkeys(row['method'] for row in rows))
    lines = [{'class': name, **{row['method']: row['ratio'] for row in rows
                                if row['class'] == name}}
             for name in dict.fromkeys(row['class'] for row in rows)]
    lines.append({'class': 'all', **_over_first(rows, methods, 'cpu_s')})
    if all('reading_s' in row for row in rows):
        lines.append({'class': 'all, reading of poses',
                      **_over_first(rows, methods, 'reading_s')})
    return [table(lines, (('class', 'class', '{}'),
                          *((method, method, '{:.2f}') for method in methods)))]


def _over_first(rows: list[Row], methods: list[str], key: str) -> dict[str, float]:
    """A time of each method, over the first method's CPU time of stepping."""
    base = sum(number(row['cpu_s']) for row in rows if row['method'] == methods[0])
    return {method: sum(number(row[key]) for row in rows if row['method'] == method) / base
            for method in methods}


def hard_table(rows: list[Row]) -> list[str]:
    """All cases by our simulation and by PyBullet at N = 10; causes of failures."""
    others = {row['case']: 'yes' if row['passed'] else ', '.join(row['faults'])
              for row in rows if row['method'] == 'bullet-10'}
    shown = [{**row, 'other': others.get(row['case'])} for row in rows
             if row['method'] != 'bullet-10']
    known = {case.name: case.reason for case in hard_cases()}
    reasons = [f'- **{row["case"]}** fails: {known.get(row["case"]) or "cause unknown"}'
               for row in shown if not row['passed']]
    return [table(shown, (
        ('case', 'case', '{}'), ('passed', 'passes', '{}'), ('faults', 'not met', '{}'),
        ('excess', 'energy excess', '{:.1e}'), ('overshoot_rad', 'overshoot °', 'deg'),
        ('sinking_m', 'penetration mm', 'mm'), ('depth_m', 'bone penetration mm', 'mm'),
        ('gap_m', 'joint gap m', '{:.0e}'), ('fastest_m_s', 'top speed m/s', '{:.1f}'),
        ('end_m_s', 'final speed m/s', '{:.3f}'),
        ('other', 'PyBullet N = 10', '{}'))), *filter(None, ['\n'.join(reasons)])]


def real_time_tables(rows: list[Row]) -> list[str]:
    """Costs of a tick; one table for each law."""
    blocks = []
    for heading, own in contact_sections.by_law(rows):
        blocks += [*heading, table(own, present(own, (
            ('label', 'method', '{}'), ('cpu_s_per_s', 'CPU ms/s', 'ms'),
            ('reading_s_per_s', 'reading ms/s', 'ms'), ('p50_s', 'tick µs', 'us'),
            ('reading_p50_s', 'reading µs', 'us'), ('p99_s', 'p99', 'us'),
            ('worst_s', 'worst', 'us'), ('over_budget', 'ticks over budget', '{:.1%}'))))]
    return blocks


CLASS_COLUMNS = (
    ('class', 'class', '{}'), ('method', 'method', '{}'), ('starts', 'starts', '{}'),
    ('bad', 'bad', '{}'), ('worst_excess', 'largest excess', '{:.1e}'),
    ('worst_start', 'its start', '{}'), ('worst_overshoot_rad', 'overshoot °', 'deg'),
    ('worst_sinking_m', 'penetration mm', 'mm'), ('worst_depth_m', 'bone penetration mm', 'mm'),
    ('worst_gap_m', 'joint gap m', '{:.0e}'), ('worst_speed_m_s', 'top speed m/s', '{:.0f}'),
    ('settled', 'settled in time', '{}'))

HARD = Section('hard', 'Hard cases, at normal', body=hard_table, law=law_note)

SECTIONS = (
    Section('energy', 'Energy over time',
            above=(('energy', 'A spinning doll: energy over time'),
                   ('drop', 'The default drop: energy over time')), law=law_note),
    Section('precision', 'Reference motions',
            'Lower left is better. Dashed: the Pareto front of CPU time and error, on which errors '
            f'below {ROUNDING:g} m or rad count as rounding.',
            body=motion_tables,
            above=(('precision', 'Error over CPU time for every motion'),), law=motion_law_note),
    Section('orders', 'Orders of convergence',
            'Slope of the error over the tick, by least squares on the logarithms; our simulation '
            'with one step per tick in flight.', (
                ('title', 'motion', '{}'), ('label', 'method', '{}'), ('theory', 'theory', '{}'),
                ('order', 'measured', '{:.2f}'),
                ('order_finest', 'between the finest two', '{:.2f}'),
                ('points', 'points', '{}')),
            below=(('orders', 'Error over the tick'),)),
    contact_sections.RESTITUTION, contact_sections.CONVERGENCE, contact_sections.SEGMENTS,
    contact_sections.DROPS, contact_sections.COLLISIONS,
    Section('classes', 'Nine classes of starts',
            'The default scene. Energy excess is the largest rise of E - work above its running '
            'minimum, over max(E0 + work); above 1e-5 a start counts as bad. Starts outside joint '
            'limits count from the recovery of the joints. Restless: not asleep after 15 more s.',
            (*CLASS_COLUMNS, ('restless', 'restless', '{}')),
            above=(('classes', 'Largest energy excess'),), law=law_note),
    Section('compared', 'The same starts by all methods',
            'The first starts of each class, the same for all methods.', CLASS_COLUMNS,
            above=(('compared', 'Largest energy excess, the same starts'),), law=law_note),
    Section('ratios', 'CPU time over that of PyBullet at N = 10',
            'Methods alternate on the same starts, in one process.', body=ratio_table,
            law=law_note),
    HARD,
    Section('costs', 'CPU time by scene', 'The default doll at normal.', (
        ('scene', 'scene', '{}'), ('tick_s', 'tick µs, median', 'us'),
        ('tick_p99_s', 'p99', 'us'))),
    Section('real_time', 'The default drop in real time, 3 s', body=real_time_tables,
            law=law_note),
    Section('estimate', 'Local error estimate',
            'Estimated over true local error of each tick in flight.', (
                ('label', 'accuracy', '{}'), ('ticks', 'ticks', '{}'),
                ('rounding', 'left out, rounding', '{}'),
                ('within_3', 'within a factor of 3', '{:.0%}'),
                ('distrusted', 'left out, not trusted', '{}')),
            below=(('estimate', 'Estimated over true error'),)),
    Section('swing', 'Swings, 3 s at several frame rates',
            'Largest errors of a damped spring released at 60°, a pendulum released horizontally '
            "and a throw. For comparison the period of VRM's spring bones, which depends on the "
            'frame rate.', (
                ('rate', 'frames per s', '{}'), ('spring_error', 'spring rad', '{:.1e}'),
                ('pendulum_error', 'pendulum rad', '{:.1e}'), ('fall_error', 'throw m', '{:.1e}'),
                ('spring_frame_s', 'frame µs', 'us'),
                ('recipe_period_s', "period of VRM's spring bone s", '{:.2f}'))),
    Section('faints', 'Faints beside real falls',
            'People stand, lean by up to 5° in a random direction, and their joints go limp group '
            'by group in random order. The descent lasts from the onset, the first instant from '
            'which the centre of mass descends faster than 0.1 m/s for 0.1 s or until a bone other '
            'than the feet hits the ground, to the impact of the pelvis. Real people try to stay '
            'up and put their hands out: [discussion](people.md#beside-real-falls).',
            body=falls_tables,
            below=(('faints', 'Impact speeds and descent times'),
                   ('faint_directions', 'Impact speeds by direction'))))


def markdown(data: dict, pictures: dict[str, str]) -> str:
    """The page of a report's data; parts without figures are left out.

    ``pictures`` are files of pictures by their names.
    """
    figures = data['figures']
    blocks = head(data['about'])
    if 'missing' not in data['about'] and figures.get('pieces'):
        blocks.append(UNLIKE)
    checked = criteria(figures)
    if checked:
        blocks += ['## Acceptance criteria', table(checked, (
            ('criterion', 'criterion', '{}'), ('required', 'required', '{}'),
            ('measured', 'measured', '{}'), ('met', 'met', '{}')))]
    if any(figures.get(part) for part in ('pieces', 'drops', 'convergence')):
        blocks.append(LAW_CHOICES)
    for section in SECTIONS:
        if figures.get(section.part):
            blocks += section.blocks(figures[section.part], pictures)
    return '\n\n'.join(blocks) + '\n'


PLAIN = """\
CPU times are those of one process. Ours are whole ticks in Python, with the poses of all bones. \
Of other engines they are those of stepping alone, N calls of the library for a tick in a plain \
loop; what it takes to read the poses of all bones is given beside them."""

WHOLE = """\
CPU times are those of whole ticks in Python, including the reading of all poses, in one process."""
"""Of figures of older versions."""

UNLIKE = """\
These figures are older than the comparison at one friction. Where a scene has unlimited friction, \
that of PyBullet and MuJoCo was 0.7, which accounts for most of their errors in short segments and \
drops. `make report` measures anew."""


def head(about: dict) -> list[str]:
    """Title, conditions of the run, and how CPU time is measured."""
    versions = ', '.join(f'{name} {version}' for name, version in about['versions'].items())
    missing = ', '.join(about.get('missing', ()))
    return ['# Speed against error', f"""\
Written by `{about['command']}`{' (quick)' if about['quick'] else ''} on {about['date']} in \
{about['seconds']:.0f} s; every figure is in `accuracy.json`.
Machine: {about['machine']}, {about['cores']} cores, {about['system']}. Python {about['python']}; \
{versions}.
{f"Our accuracies are those of the engine {about['engine']}." if 'engine' in about else ''}\
{f" Not compared, as not installed: {missing}." if missing else ''}\
{''.join(dict.fromkeys(newer(part, about['machine'])
                        for part in about.get('updated', {}).values()))}""",
            f"""\
{PLAIN if 'missing' in about else WHOLE} On reference motions each tick counts with the median of \
its runs; in comparisons with PyBullet and of scenes with the least, which excludes the load of \
other processes. Compare ratios, not times. N is the number of substeps in a tick of 10 ms."""]


def newer(part: dict, machine: str) -> str:
    """Sentence on a part that a later run measured again, maybe not on the same ``machine``."""
    where = '' if part['machine'] == machine else f', on another machine: {part["machine"]}'
    return f" Measured again by `{part['command']}` on {part['date']}{where}."
