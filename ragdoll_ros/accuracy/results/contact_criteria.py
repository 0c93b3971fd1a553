"""Acceptance criteria of impacts and contacts."""
import math
from collections.abc import Iterator

import numpy as np

from .figures import Figures, Row, by_setting, criterion, number, sound
from .laws import law_name

CLOSED_FORMS = ('bounce', 'bounce_0.1', 'bounce_0.9', 'bounce_1', 'rod_frictionless', 'rod_sticks',
                'rod_slides', 'two_balls', 'three_balls')
"""Motions whose contact impulses have a closed form."""

APEX, FORMULA, PEAK = 1e-6, 1e-6, 0.01
"""Largest errors: of apexes, relative; of closed forms, m; of Housner's ninth peak, relative."""

SEGMENTS = {'draft': (1.0, 7.0, 0.6), 'normal': (0.4, 3.0, 1.0), 'exact': (0.05, 1.0, 3.0)}
"""Largest median and 90th percentile of segment errors, mm; CPU over PyBullet's at N = 10."""

MOMENTUM_DRIFT, PENETRATION = 1e-9, 1.0
"""In a collision in the air: relative drift of the momenta; penetration of bones, mm."""

STANDARD_ERRORS = 2.0
"""Largest difference of mean energies of drops from the reference's."""


def contact_criteria(figures: Figures) -> Iterator[Row]:
    """One row for each criterion that the run has figures for."""
    for check in (_restitution, _closed_forms, _rocking, _segments, _not_dominated, _drops,
                  _collisions, _rest):
        yield from check(figures)


def _restitution(figures: Figures) -> Iterator[Row]:
    for accuracy, rows in by_setting(figures, 'restitution'):
        worst = float(np.max([number(row['worst']) for row in rows]))
        apexes = sum(row['seen'] for row in rows)
        found = [row['restitution'] for row in rows]
        span = f'e = {min(found):g} to {max(found):g}'
        yield criterion(f'apexes of single bodies, {span}, {accuracy}',
                        f'relative error at most {APEX:g}', f'{apexes} apexes, largest {worst:.1e}',
                        worst <= APEX)


def _closed_forms(figures: Figures) -> Iterator[Row]:
    for accuracy, rows in by_setting(figures, 'precision',
                                     lambda row: row['motion'] in CLOSED_FORMS):
        errors = {row['motion']: number(row['position_worst_m']) for row in rows}
        name = max(errors, key=lambda motion: np.nan_to_num(errors[motion], nan=math.inf))
        yield criterion(f'impacts with a closed form, {accuracy}', f'within {FORMULA:g} m',
                        f'{len(errors)} motions, largest {errors[name]:.1e} m ({name})',
                        errors[name] <= FORMULA)


def _rocking(figures: Figures) -> Iterator[Row]:
    for accuracy, rows in by_setting(figures, 'precision', lambda row: 'peak_9_error' in row):
        error = number(rows[0]['peak_9_error'])
        yield criterion(f'ninth peak of a rocking block, {accuracy}',
                        f'within {PEAK:.0%} of Housner', f'{error:.1%} off', error <= PEAK)


def _segments(figures: Figures) -> Iterator[Row]:
    bases = {law_name(row): number(row['cpu_s_per_s'])
             for row in sound(figures.get('pieces', ())) if row.get('method') == 'bullet-10'}
    for accuracy, rows in by_setting(figures, 'pieces', lambda row: 'reference' in row):
        for row in rows:
            yield from _segment(row, accuracy, bases.get(law_name(row)))


def _segment(row: Row, accuracy: str, base: float | None) -> Iterator[Row]:
    """Yield criteria of a row's errors and, if there is a ``base``, s per s, of its CPU time over
    it.
    """
    median, most, ratio = SEGMENTS[accuracy]
    name = f'{_law(row)}, {accuracy}'
    found = 1e3 * number(row['position_median_m']), 1e3 * number(row['position_p90_m'])
    yield criterion(f'short segments through contacts{name}',
                    f'median at most {median:g} mm, 90 % at most {most:g} mm',
                    f'{found[0]:.2f} mm, {found[1]:.2f} mm{_uncertainty(row)}',
                    found[0] <= median and found[1] <= most)
    if base:
        over = number(row['cpu_s_per_s']) / base
        yield criterion(f'CPU of segments over PyBullet N = 10{name}', f'at most {ratio:g}',
                        f'{over:.2f}', over <= ratio)


def _uncertainty(row: Row) -> str:
    """Standard errors of median and 90th percentile, if the row has them."""
    if 'position_p90_se_m' not in row:
        return ''
    median, most = (1e3 * number(row[f'position_{name}_se_m']) for name in ('median', 'p90'))
    return f' (standard errors {median:.2f}, {most:.2f})'


def _law(row: Row) -> str:
    """Contact parameters of a row in a criterion's name."""
    name = law_name(row)
    return f', {name}' if name else ''


def _not_dominated(figures: Figures) -> Iterator[Row]:
    """Yield criteria: no engine is faster than ours and closer to its own finest run, which favours
    the others.
    """
    others = [row for row in sound(figures.get('pieces', ()))
              if row['family'] != 'ours' and 'own_median_m' in row]
    for accuracy, rows in by_setting(figures, 'pieces', lambda row: 'own_median_m' in row):
        for row in rows:
            ours = [number(row[key]) for key in ('cpu_s_per_s', 'own_median_m')]
            better = [other['label'] for other in others
                      if law_name(other) == law_name(row)
                      and number(other['cpu_s_per_s']) < ours[0]
                      and number(other['own_median_m']) < ours[1]]
            yield criterion(f'no engine is faster and closer to its own limit{_law(row)}, '
                            f'{accuracy}', 'none', ', '.join(better) or 'none', not better)


def _drops(figures: Figures) -> Iterator[Row]:
    for accuracy, rows in by_setting(figures, 'drops',
                                     lambda row: row['population'].startswith('default')):
        for row in rows:
            law = row['population'].removeprefix('default, tilted')
            off = {key.removesuffix('_off'): number(row[key]) for key in row
                   if key.startswith('energy') and key.endswith('_off')}
            measured = ', '.join(f'{value:.1f} at {key.removeprefix("energy_")}'
                                 for key, value in off.items())
            yield criterion(f'energies of {row["drops"]} default drops{law}, {accuracy}',
                            f'within {STANDARD_ERRORS:g} standard errors of the reference',
                            measured, max(off.values()) <= STANDARD_ERRORS)


def _collisions(figures: Figures) -> Iterator[Row]:
    for accuracy, rows in by_setting(figures, 'collisions'):
        lost = float(np.max([number(row[key]) for row in rows
                             for key in ('momentum_drift', 'angular_momentum_drift')]))
        depth = 1e3 * float(np.max([number(row['depth_m']) for row in rows]))
        yield criterion(
            f'dolls that collide in the air, {accuracy}',
            f'momentum drift at most {MOMENTUM_DRIFT:g}, penetration {PENETRATION:g} mm',
            f'{lost:.0e}, {depth:.2f} mm', lost <= MOMENTUM_DRIFT and depth <= PENETRATION)


def _rest(figures: Figures) -> Iterator[Row]:
    for accuracy, rows in by_setting(figures, 'classes', lambda row: 'restless' in row):
        restless, starts = (sum(row[key] for row in rows) for key in ('restless', 'starts'))
        yield criterion(f'asleep 15 s after every start, {accuracy}', 'all',
                        f'{starts - restless} of {starts}', not restless)
