"""Two dolls that collide in the air: conservation of momentum, and penetration of bones."""
import functools
import math

from ...physics.accuracy import ACCURACIES
from ..cases.comparison import FRICTION, compared
from ..cases.contact_cases import COLLISIONS, two_dolls
from ..crowds.depth import BoneDepth
from ..methods import by_name, run
from ..metrics import Metrics
from ..results.runner import Job, Row, RunOptions

NAME = 'collisions'
FIGURES = ('momentum_drift', 'angular_momentum_drift', 'depth_m', 'energy_excess')
OTHERS = ('bullet-4', 'bullet-10', 'mujoco-implicitfast-4', 'mujoco-implicitfast-10')


def jobs(options: RunOptions) -> list[Job]:
    """One job for each method."""
    names = [*(f'ours-{accuracy}' for accuracy in ACCURACIES),
             *(OTHERS[1:2] if options.quick else OTHERS)]
    return [Job(NAME, f'collisions, {name}', functools.partial(measure, name), 2.0)
            for name in names]


def measure(name: str) -> list[Row]:
    """One row for each approach speed."""
    method, rows = by_name(name), []
    for speed in COLLISIONS:
        trial = compared(two_dolls(speed))
        moved, metrics = run(method, trial).trajectory, Metrics(trial.scene)
        row: Row = {'method': name, 'label': method.label, 'friction': FRICTION,
                    'speed_m_s': speed}
        rows.append(row | (dict.fromkeys(FIGURES, math.inf) if not moved.finite else {
            'momentum_drift': metrics.momentum_drift(trial, moved),
            'angular_momentum_drift': metrics.angular_momentum_drift(moved),
            'depth_m': BoneDepth(trial.scene).deepest(moved),
            'energy_excess': metrics.energy_excess(trial, moved)}))
    return rows
