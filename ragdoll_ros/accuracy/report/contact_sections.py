"""Sections about contacts: convergence, restitution, segments, drops, collisions."""
from collections.abc import Iterator

from ..results.figures import Row, number
from ..results.laws import law_name, law_note, motion_law_note
from ..results.markdown import Section, present, table


def convergence_tables(rows: list[Row]) -> list[str]:
    """A table for each motion: error at h, h/2 ... h/64, one line per engine."""
    blocks = []
    for motion in dict.fromkeys(row['motion'] for row in rows):
        own = [row for row in rows if row['motion'] == motion]
        unit = {'position_worst_m': 'm', 'angle_worst_rad': 'rad'}[own[0]['yardstick']]
        lines = [{**row, 'h': row['steps_s'][0], 'itself': row['own'][-1],
                  **{str(k): error for k, error in enumerate(row['errors'])}} for row in own]
        halves = [(str(k), f'h/{2 ** k}' if k else f'h: error {unit}', '{:.0e}')
                  for k in range(len(own[0]['errors']))]
        blocks += [f'### {own[0]["title"]}, error against step size', table(lines, (
            ('label', 'engine', '{}'), ('h', 'h ms', 'ms'), *halves,
            ('order', 'slope', '{:.2f}'),
            ('itself', 'self-convergence: h/32 against h/64', '{:.0e}')))]
    return blocks


def restitution_tables(rows: list[Row]) -> list[str]:
    """Restitution of the first bounce and largest apex error, one line per method and body."""
    wanted = list(dict.fromkeys(row['restitution'] for row in rows))
    lines: dict[tuple, Row] = {}
    for row in rows:
        line = lines.setdefault((row['label'], row['body']), {
            'label': row['label'], 'body': row['body'], 'seen': 0, 'flights': 0})
        line |= {f'found {row["restitution"]}': row['found'],
                 f'worst {row["restitution"]}': row['worst'],
                 'seen': line['seen'] + row['seen'], 'flights': line['flights'] + row['flights']}
    first = (('label', 'method', '{}'), ('body', 'body', '{}'))
    return [table(lines.values(), (*first, *((f'found {e}', f'e = {e:g}', '{:.4f}')
                                             for e in wanted))),
            '### Largest relative error of all apexes after an approach of 0.05 m/s or more',
            table(lines.values(), (*first, *((f'worst {e}', f'e = {e:g}', '{:.0e}')
                                             for e in wanted),
                                   ('seen', 'apexes measured', '{}'), ('flights', 'of', '{}')))]


RESTITUTION = Section(
    'restitution', 'Restitution of single bodies',
    'Released level at 1 m. The first table has the measured restitution of the first bounce.',
    body=restitution_tables, law=motion_law_note)

CONVERGENCE = Section(
    'convergence', 'Convergence of motions with contacts',
    'The references are closed forms and event-driven integrations that share no code with an '
    'engine. A slope near 0 means that an engine converges to another solution, however small '
    'its difference to its own finest run.', body=convergence_tables,
    above=(('convergence', 'Error over step size, by motion'),), law=motion_law_note)


def by_law(rows: list[Row]) -> Iterator[tuple[list[str], list[Row]]]:
    """Yield a heading, none for figures of older versions, and the rows of each law."""
    for name in dict.fromkeys(map(law_name, rows)):
        yield [f'### {name}'] if name else [], [row for row in rows if law_name(row) == name]


def segments_tables(rows: list[Row]) -> list[str]:
    """The reference, and a table for each law."""
    names = ', '.join(dict.fromkeys(row['reference'] for row in rows if 'reference' in row))
    blocks = [f'Reference: {names}.'] * bool(names)
    for heading, own in by_law(rows):
        blocks += [*heading, segments_table(own)]
    return blocks


def segments_table(rows: list[Row]) -> str:
    """Errors of short segments, and CPU time over that of PyBullet at N = 10."""
    base = next((number(row['cpu_s_per_s']) for row in rows if row['method'] == 'bullet-10'), None)
    lines = [{**row, 'ratio': base and number(row['cpu_s_per_s']) / base} for row in rows]
    return table(lines, present(lines, (
        ('label', 'method', '{}'), ('cpu_s_per_s', 'CPU ms/s', 'ms'),
        ('ratio', 'over PyBullet N = 10', '{:.2f}'), ('reading_s_per_s', 'reading ms/s', 'ms'),
        ('position_median_m', 'position mm, median', 'mm'), ('position_p90_m', '90 %', 'mm'),
        ('position_p90_se_m', 'its standard error', 'mm'),
        ('angle_median_rad', 'angle °, median', 'deg'),
        ('gap_worst_m', 'largest joint gap m', '{:.0e}'),
        ('sinking_worst_m', 'largest penetration mm', 'mm'),
        ('own_median_m', 'self-convergence: against its finest mm, median', 'mm'),
        ('own_p90_m', '90 %', 'mm'))))


SEGMENTS = Section(
    'pieces', 'Short segments through contacts',
    'Segments of 0.1 s from instants of 60 drops of the default doll, with self-collision (after '
    'Erez, Tassa and Todorov, ICRA 2015), against one reference. The last two columns are no '
    'errors: they compare each engine with its own finest run. Without restitution and friction '
    'all engines have the same law: there the finest steps of each are an independent check of '
    'the reference.',
    body=segments_tables, law=law_note,
    below=(('pieces', 'Error over CPU time through contacts'),))

DROP_HEADS = {'energy_0.3s': 'relative energy at 0.3 s', 'energy_0.5s': 'at 0.5 s',
              'energy_1s': 'at 1 s', 'slide_m': 'slide m', 'settled_s': 'settling time s',
              'spread_m': 'spread of bones m'}


def drop_tables(rows: list[Row]) -> list[str]:
    """Means with standard errors and p-values; one table per population."""
    blocks = []
    for population in dict.fromkeys(row['population'] for row in rows):
        own = [row for row in rows if row['population'] == population]
        lines = [{'label': row['label'] + (', the reference' if row is own[0] else ''),
                  **{key: f'{number(row[f"{key}_mean"]):.3f} ± {number(row[f"{key}_error"]):.3f}'
                     + ('' if row is own[0] else f' (p {number(row[f"{key}_p"]):.2g})')
                     for key in DROP_HEADS}} for row in own]
        blocks += [f'### {own[0]["drops"]} drops, {population}', table(lines, (
            ('label', 'method', '{}'),
            *((key, head, '{}') for key, head in DROP_HEADS.items())))]
    return blocks


DROPS = Section(
    'drops', 'Statistics of many drops',
    'A fall is chaotic, the distribution of many is not. Means with their standard errors; p is '
    'that of the two-sample Kolmogorov-Smirnov test against the reference: where it is small, the '
    'distributions differ. At e = 0 the laws of most engines agree: MuJoCo at N = 100, in steps of '
    '0.1 ms, is an independent check of the reference.', body=drop_tables, law=law_note,
    below=(('drops', 'Distributions of random drops'),))

COLLISIONS = Section(
    'collisions', 'Two dolls that collide in the air',
    'Drift of momentum, over the sum of all m |v|, and of angular momentum about the common centre '
    'of mass; penetration of bones by the distance functions of MuJoCo.', (
        ('label', 'method', '{}'), ('speed_m_s', 'm/s', '{:g}'),
        ('momentum_drift', 'momentum drift', '{:.0e}'),
        ('angular_momentum_drift', 'angular m. drift', '{:.0e}'),
        ('depth_m', 'bone penetration mm', 'mm'), ('energy_excess', 'energy excess', '{:.0e}')),
    law=law_note)
