"""Acceptance criteria, checked against the figures of a run."""
import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ...physics.accuracy import ACCURACIES
from .contact_criteria import contact_criteria
from .figures import Figures, Row, by_setting, criterion, number, sound

ROUNDING = 1e-12
"""m or rad: smaller errors count as zero on the Pareto front."""

EXCESS = 1e-5
"""Largest relative energy gain."""

CPU_RATIOS = {'draft': 0.5, 'normal': 0.8, 'exact': 1.3}
"""Largest CPU time of each accuracy over that of PyBullet at N = 10."""


def _has_rest(row: Row) -> bool:
    """Whether a row of starts was followed to rest, unlike those of older versions."""
    return 'restless' in row


@dataclass(frozen=True)
class Bound:
    """At each accuracy, an upper bound of the largest figure in the rows of a part."""

    name: str
    part: str
    keys: tuple[str, ...]
    most: dict[str, float]
    """By accuracy, in the displayed unit."""
    required: str
    measured: str
    """Formats of the bound and of the largest figure."""
    keep: Callable[[Row], bool]
    """Which rows the bound applies to."""
    factor: float = 1.0
    """Displayed unit over SI unit."""


BOUNDS = (
    Bound('largest limit overshoot', 'classes', ('worst_overshoot_rad',), {'normal': 0.2},
          'at most {:g}°', '{:.2f}°', _has_rest, 180 / math.pi),
    Bound('largest penetration, of the ground and of bones', 'classes',
          ('worst_sinking_m', 'worst_depth_m'), {'normal': 1.0}, 'at most {:g} mm', '{:.2f} mm',
          _has_rest, 1e3),
    Bound('gentle flight of 0.28 s', 'precision', ('position_worst_m',),
          {'draft': 3e-3, 'normal': 60e-6, 'exact': 10e-6}, 'at most {:g} m', '{:.1e} m',
          lambda row: row['motion'] == 'flight_gentle'),
    Bound('free fall and throw', 'precision', ('position_worst_m',),
          dict.fromkeys(ACCURACIES, 1e-9), 'at most 1e-9 m', '{:.1e} m',
          lambda row: row['motion'] in ('free_fall', 'projectile')),
    Bound('drift of momentum and angular momentum', 'precision',
          ('momentum_drift', 'angular_momentum_drift'), dict.fromkeys(ACCURACIES, 1e-9),
          'at most 1e-9', '{:.1e}', lambda row: 'momentum_drift' in row))


def criteria(figures: Figures) -> list[Row]:
    """One row for each criterion that the run has figures for."""
    rows = [*_energy(figures), *_cost(figures)]
    for bound in BOUNDS:
        rows += _largest(bound, figures)
    for check in (contact_criteria, _hard, _estimate, _costs_fall, _orders, _front):
        rows += check(figures)
    return rows


def _largest(bound: Bound, figures: Figures) -> Iterator[Row]:
    """Yield the criterion of a bound at each accuracy; NaN meets no bound."""
    for accuracy, rows in by_setting(figures, bound.part, bound.keep):
        if accuracy not in bound.most:
            continue
        largest = bound.factor * float(np.max([
            number(row[key]) for row in rows for key in bound.keys if key in row]))
        most = bound.most[accuracy]
        yield criterion(f'{bound.name}, {accuracy}', bound.required.format(most),
                        bound.measured.format(largest), largest <= most)


def _energy(figures: Figures) -> Iterator[Row]:
    for accuracy, rows in by_setting(figures, 'classes', _has_rest):
        bad, starts = (sum(row[key] for row in rows) for key in ('bad', 'starts'))
        worst = max(number(row['worst_excess']) for row in rows)
        yield criterion(f'energy excess in every start, {accuracy}', 'at most 1e-5',
                        f'{bad} of {starts} bad, worst {worst:.1e}', not bad and worst <= EXCESS)


def _cost(figures: Figures) -> Iterator[Row]:
    base = sum(number(row['cpu_s']) for row in figures.get('ratios', ())
               if row.get('method') == 'bullet-10')
    if not base:
        return
    for accuracy, rows in by_setting(figures, 'ratios'):
        ratio, most = sum(number(row['cpu_s']) for row in rows) / base, CPU_RATIOS[accuracy]
        yield criterion(f'CPU over PyBullet N = 10, {accuracy}', f'at most {most:g}',
                        f'{ratio:.2f}', ratio <= most)


def _hard(figures: Figures) -> Iterator[Row]:
    rows = [row for row in figures.get('hard', ()) if row.get('method') == 'ours-normal']
    failing = ', '.join(row['case'] for row in rows if not row['passed'])
    if rows:
        yield criterion('hard cases at normal', f'all {len(rows)}',
                        f'{sum(row["passed"] for row in rows)} pass'
                        + (f'; failing: {failing}' if failing else ''), not failing)


def _estimate(figures: Figures) -> Iterator[Row]:
    for row in figures.get('estimate', ()):
        share = number(row.get('within_3'))
        if row.get('ticks') and 'rounding' in row:
            yield criterion(f'error estimate within a factor of 3, {row.get("label")}',
                            '90 % of flight ticks above rounding',
                            f'{share:.0%} of {row.get("ticks")}', share >= 0.9)


def _costs_fall(figures: Figures) -> Iterator[Row]:
    costs = [number(row['tick_s']) for row in figures.get('costs', ()) if 'tick_s' in row]
    # Timings on a shared machine vary by a tenth.
    rising = sum(later > 1.1 * earlier for earlier, later in itertools.pairwise(costs))
    if costs:
        yield criterion('simpler scenes cost less', 'decreases from row to row',
                        f'increases {rising} times' if rising else 'decreases', not rising)


def _orders(figures: Figures) -> Iterator[Row]:
    rows = [row for row in figures.get('orders', ()) if row.get('theory')]
    off = [f'{row["method"]} {number(row["order"]):.2f} ({row["motion"]})' for row in rows
           if not abs(number(row['order']) - row['theory']) <= 0.2]
    if rows:
        yield criterion('orders of convergence', 'within 0.2 of theory', ', '.join(off) or 'all',
                        not off)


def _front(figures: Figures) -> Iterator[Row]:
    """Pareto front: no other method is both faster and more accurate."""
    rows = sound(figures.get('precision', ()))
    dominated: dict[str, list[str]] = {}
    for row in rows:
        if row['family'] == 'ours':
            motions = dominated.setdefault(row['method'], [])
            if any(_dominates(other, row) for other in rows):
                motions.append(row['motion'])
    count = len({row['motion'] for row in rows})
    for method, motions in dominated.items():
        yield criterion(f'on the Pareto front of CPU time and error, {method}',
                        f'in all {count} motions',
                        f'dominated in {len(motions)}: {", ".join(motions)}' if motions else 'all',
                        not motions)


def _dominates(other: Row, ours: Row) -> bool:
    """Whether another method is faster and more accurate, beyond rounding."""
    cost, error = number(ours['cpu_s_per_s']), number(ours[ours['yardstick']])
    return (other['motion'] == ours['motion'] and other['family'] != 'ours'
            and number(other['cpu_s_per_s']) < cost and error > ROUNDING
            and number(other[other['yardstick']]) < error * (1 - 1e-9))
