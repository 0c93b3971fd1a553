"""What was promised, held against the figures of this run: a line for each promise."""
from __future__ import annotations

import itertools
import math
from collections.abc import Callable

Row = dict[str, object]
Figures = dict[str, list[Row]]

RATIOS = {'draft': 0.5, 'normal': 0.8, 'exact': 1.3}
OVERSHOOT_DEG = {'draft': 15.0, 'normal': 6.0, 'exact': 2.5}
SINKING_PUSHED_MM = {'draft': 100.0, 'normal': 40.0, 'exact': 20.0}
SINKING_MM = {'draft': 10.0, 'normal': 5.0, 'exact': 2.0}
FLIGHT_M = {'draft': 3e-3, 'normal': 60e-6, 'exact': 10e-6}


def goals(figures: Figures) -> list[Row]:
    """One row for each promise that this run has figures for: what, wanted, found, held."""
    rows: list[Row] = []
    for goal in (_energy, _cost, _overshoot, _sinking, _flight, _fall, _momentum, _hard,
                 _estimate, _costs_fall, _orders, _front):
        rows += goal(figures)
    return rows


def number(value: object) -> float:
    """Read a figure of the JSON, in which infinity is a text and NaN is null."""
    return math.nan if value is None else float(value)


def _row(what: str, wanted: str, found: str, held: bool) -> Row:
    return {'goal': what, 'wanted': wanted, 'found': found, 'held': held}


def _ours(figures: Figures, part: str, accuracy: str) -> list[Row]:
    return [row for row in figures.get(part, ()) if row.get('method') == f'ours-{accuracy}']


def _each(figures: Figures, part: str, judge: Callable[[str, list[Row]], Row],
          keep: Callable[[Row], bool] = lambda row: True) -> list[Row]:
    """Judge each setting on those of its rows of a part that are to be kept, if there are any."""
    found = {accuracy: [row for row in _ours(figures, part, accuracy) if keep(row)]
             for accuracy in RATIOS}
    return [judge(accuracy, rows) for accuracy, rows in found.items() if rows]


def _energy(figures: Figures) -> list[Row]:
    def judge(accuracy: str, rows: list[Row]) -> Row:
        bad = sum(row['bad'] for row in rows)
        starts = sum(row['starts'] for row in rows)
        worst = max(number(row['worst_excess']) for row in rows)
        return _row(f'energy excess in every start, {accuracy}', 'at most 0.1 %',
                    f'{bad} of {starts} bad, worst {worst:.2%}', bad == 0)
    return _each(figures, 'classes', judge)


def _cost(figures: Figures) -> list[Row]:
    base = sum(number(row['cpu_s']) for row in figures.get('ratios', ())
               if row.get('method') == 'bullet-10')

    def judge(accuracy: str, rows: list[Row]) -> Row:
        ratio = sum(number(row['cpu_s']) for row in rows) / base
        return _row(f'CPU over PyBullet N = 10, {accuracy}', f'at most {RATIOS[accuracy]:g}',
                    f'{ratio:.2f}', ratio <= RATIOS[accuracy])
    return _each(figures, 'ratios', judge) if base else []


def _overshoot(figures: Figures) -> list[Row]:
    def judge(accuracy: str, rows: list[Row]) -> Row:
        worst = max(math.degrees(number(row['worst_overshoot_rad'])) for row in rows)
        bound = OVERSHOOT_DEG[accuracy]
        return _row(f'worst limit overshoot, {accuracy}', f'at most {bound:g}°', f'{worst:.1f}°',
                    worst <= bound)
    return _each(figures, 'classes', judge, lambda row: row['class'] != 'start outside')


def _sinking(figures: Figures) -> list[Row]:
    def judge(accuracy: str, rows: list[Row]) -> Row:
        worst = max(1e3 * number(row['worst_sinking_m']) for row in rows)
        pushed = rows[0]['class'].startswith('push')
        bound = (SINKING_PUSHED_MM if pushed else SINKING_MM)[accuracy]
        where = 'in pushes' if pushed else 'elsewhere'
        return _row(f'worst sinking {where}, {accuracy}', f'at most {bound:g} mm',
                    f'{worst:.1f} mm', worst <= bound)
    return (_each(figures, 'classes', judge, lambda row: row['class'].startswith('push'))
            + _each(figures, 'classes', judge, lambda row: not row['class'].startswith('push')))


def _flight(figures: Figures) -> list[Row]:
    def judge(accuracy: str, rows: list[Row]) -> Row:
        error, bound = number(rows[0]['position_worst_m']), FLIGHT_M[accuracy]
        return _row(f'gentle flight of 0.28 s, {accuracy}', f'at most {bound:g} m',
                    f'{error:.1e} m', error <= bound)
    return _each(figures, 'precision', judge, lambda row: row['motion'] == 'flight_gentle')


def _fall(figures: Figures) -> list[Row]:
    def judge(accuracy: str, rows: list[Row]) -> Row:
        error = max(number(row['position_worst_m']) for row in rows)
        return _row(f'free fall and throw, {accuracy}', 'at most 1e-9 m', f'{error:.1e} m',
                    error <= 1e-9)
    return _each(figures, 'precision', judge,
                 lambda row: row['motion'] in ('free_fall', 'projectile'))


def _momentum(figures: Figures) -> list[Row]:
    def judge(accuracy: str, rows: list[Row]) -> Row:
        worst = max(number(row[key]) for row in rows
                    for key in ('momentum_drift', 'angular_momentum_drift')
                    if row.get(key) is not None)
        return _row(f'momentum and angular momentum kept, {accuracy}', 'to 1e-9', f'{worst:.1e}',
                    worst <= 1e-9)
    return _each(figures, 'precision', judge, lambda row: row.get('momentum_drift') is not None)


def _hard(figures: Figures) -> list[Row]:
    rows = [row for row in figures.get('hard', ()) if row.get('method') == 'ours-normal']
    if not rows:
        return []
    failing = [row['case'] for row in rows if not row['passed']]
    return [_row('hard cases at normal', f'all {len(rows)}',
                 f'{len(rows) - len(failing)} hold' + (f'; not: {", ".join(failing)}'
                                                       if failing else ''), not failing)]


def _estimate(figures: Figures) -> list[Row]:
    made = []
    for row in figures.get('estimate', ()):
        if row.get('missing') or 'failed' in row:
            made.append(_row(f'live estimate, {row.get("label")}', '90 % within a factor 3',
                             'there is none', False))
            continue
        share = number(row['within_3'])
        made.append(_row(f'live estimate within a factor 3, {row["label"]}', '90 % of flight ticks',
                         f'{share:.0%} of {row["ticks"]}', share >= 0.9))
    return made


def _costs_fall(figures: Figures) -> list[Row]:
    costs = [number(row['tick_s']) for row in figures.get('costs', ()) if 'tick_s' in row]
    if not costs:
        return []
    # timing on a shared machine is good to a tenth
    rising = sum(later > 1.1 * earlier for earlier, later in itertools.pairwise(costs))
    return [_row('a scene that needs less costs less', 'falls from row to row',
                 f'rises {rising} times' if rising else 'falls', not rising)]


def _orders(figures: Figures) -> list[Row]:
    rows = [row for row in figures.get('orders', ()) if row.get('theory')]
    if not rows:
        return []
    off = [f'{row["method"]} {number(row["order"]):.2f} ({row["motion"]})' for row in rows
           if not abs(number(row['order']) - row['theory']) <= 0.2]
    return [_row('orders', 'within 0.2 of theory', ', '.join(off) if off else 'all are', not off)]


def _front(figures: Figures) -> list[Row]:
    """No other method is both faster and more accurate."""
    rows = [row for row in figures.get('precision', ()) if 'failed' not in row]
    beaten: dict[str, list[str]] = {}
    for mine in rows:
        if mine['family'] != 'ours':
            continue
        cost, error = number(mine['cpu_s_per_s']), number(mine[mine['yardstick']])
        better = [row['label'] for row in rows if row['motion'] == mine['motion']
                  and row['family'] != 'ours' and number(row['cpu_s_per_s']) < cost
                  and number(row[row['yardstick']]) < error * (1 - 1e-9) and error > 1e-12]
        if better:
            beaten.setdefault(mine['method'], []).append(mine['motion'])
    motions = len({row['motion'] for row in rows})
    return [_row(f'on the front of speed and error, {method}', f'in all {motions} motions',
                 f'beaten in {len(beaten.get(method, ()))}: {", ".join(beaten.get(method, ()))}'
                 if method in beaten else 'yes', method not in beaten)
            for method in dict.fromkeys(row['method'] for row in rows if row['family'] == 'ours')]
