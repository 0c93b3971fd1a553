"""Energy over time of a drop and of a free spin; tick costs of the drop."""
import functools

import numpy as np

from ...files.doll import load_doll
from ...model import rotation
from ...model.scene import Placement
from ..cases.comparison import FRICTION, RESTITUTIONS, drop_scene
from ..cases.trial import Trial, posed
from ..methods import by_name, installed, median_run, run
from ..metrics import Metrics
from ..motions.motion import airborne_scene, without_damping, without_limits
from ..results.runner import Job, Row, RunOptions

NAME = 'energy'
COST = 'real_time'


def jobs(options: RunOptions) -> list[Job]:
    """Jobs of energy over time and of the drop's tick costs."""
    made = [Job(NAME, f'energy, {scene}', functools.partial(energies, scene), 3)
            for scene in ('drop', 'spin')]
    made += [Job(COST, f'the default drop in real time, e = {restitution:g}', functools.partial(
        tick_costs, restitution, 1 if options.quick else 5), 2 if options.quick else 8, timed=True)
        for restitution in RESTITUTIONS]
    return made


def falling(restitution: float = RESTITUTIONS[0]) -> Trial:
    """The default drop with the friction of comparisons, 3 s."""
    return Trial(drop_scene(restitution), 3.0)


def spinning() -> Trial:
    """A doll spun at 10 rad/s without contacts and damping: its energy is constant."""
    placed = {'spin': tuple(10 * rotation.normalized(np.array((1.0, 2.0, 2.0))))}
    doll = without_limits(without_damping(load_doll('doll')))
    return Trial(airborne_scene(doll, (0.0, 0.0, 0.0), **placed), 3.0,
                 posed(Placement(doll, **placed)))


def energies(scene: str) -> list[Row]:
    """Energy relative to that at the start, at every tick, by three methods."""
    trial, rows = {'drop': falling, 'spin': spinning}[scene](), []
    for method in map(by_name, ('quickstart', 'bullet-1', 'ours-normal')):
        trajectory = run(method, trial).trajectory
        energy = Metrics(trial.scene).energy(trajectory)
        rows.append({'scene': scene, 'method': method.name, 'label': method.label,
                     **({'friction': FRICTION} if scene == 'drop' else {}),
                     'time_s': trajectory.times.tolist(), 'energy': (energy / energy[0]).tolist()})
    return rows


TIMED = ('ours-draft', 'ours-normal', 'ours-exact', 'bullet-10', 'bullet-4', 'bullet-1',
         'quickstart', 'mujoco-implicitfast-10', 'mujoco-implicitfast-4', 'mujoco-implicitfast-1',
         'mujoco-rk4-4', 'dart-10', 'dart-4', 'dart-1')


def tick_costs(restitution: float, repeats: int) -> list[Row]:
    """Tick costs of the drop, 3 s; Drake has no restitution."""
    rows, trial = [], falling(restitution)
    for method in map(by_name, installed((*TIMED, *(() if restitution else ('drake-10',))))):
        result = median_run(method, trial, repeats)
        costs, tick = result.costs, method.tick or trial.scene.step
        rows.append({'method': method.name, 'label': method.label, 'friction': FRICTION,
                     'restitution': restitution, 'tick_s': tick,
                     'cpu_s_per_s': result.cpu_s_per_s, 'reading_s_per_s': result.reading_s_per_s,
                     'reading_p50_s': float(np.median(result.reading)),
                     'p50_s': float(np.median(costs)), 'p99_s': float(np.percentile(costs, 99)),
                     'worst_s': float(costs.max()), 'over_budget': float((costs > tick).mean())})
    return rows
