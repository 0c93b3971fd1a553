"""Work-precision: CPU time and error of every method on every reference motion."""
import functools

import numpy as np

from ..methods import Method, Result, all_methods, by_name, median_run
from ..metrics import Metrics, compare
from ..motions.contact import contact_motions
from ..motions.flight import flight_motions
from ..motions.impacts import impact_motions
from ..motions.mechanisms import mechanism_motions
from ..motions.motion import ReferenceMotion
from ..motions.planar_doll import planar_motions
from ..results.runner import Job, Row, RunOptions
from ..trajectory import Trajectory

NAME = 'precision'
QUICK_MOTIONS = ('free_fall', 'projectile', 'pendulum_large', 'tumbling_box', 'flight_gentle',
                 'flight_fast', 'bounce', 'rod_slides', 'rocking_block')


def jobs(options: RunOptions) -> list[Job]:
    """One timed job for each motion."""
    names = [motion.name for motion in motions().values()
             if not options.quick or motion.name in QUICK_MOTIONS]
    methods = [method.name for method in all_methods((1, 4, 16) if options.quick
                                                      else (1, 2, 4, 8, 16, 32))]
    repeats = 1 if options.quick else 5
    return [Job(NAME, name, functools.partial(measure_all, name, methods, repeats),
                weight=(0.15 if options.quick else 1.2) * motions()[name].trial.duration + 1,
                timed=True) for name in names]


@functools.cache
def motions() -> dict[str, ReferenceMotion]:
    """All reference motions by name, simple ones first; cached."""
    return {motion.name: motion
            for motion in (*flight_motions(), *mechanism_motions(), *contact_motions(),
                           *impact_motions(), *planar_motions())}


def measure_all(motion_name: str, method_names: list[str], repeats: int) -> list[Row]:
    """Run a motion by all methods, ``repeats`` times each."""
    motion, truths, rows = motions()[motion_name], {}, []
    for name in method_names:
        method = by_name(name)
        result = median_run(method, motion.trial, repeats)
        times = result.trajectory.times
        if len(times) not in truths:
            truths[len(times)] = motion.truth(times)
        rows.append(figures(motion, method, result, truths[len(times)]))
    return rows


def figures(motion: ReferenceMotion, method: Method, result: Result, truth: Trajectory) -> Row:
    """All figures of a motion by a method."""
    trajectory, trial = result.trajectory, motion.trial
    metrics = Metrics(trial.scene)
    row: Row = {'motion': motion.name, 'title': motion.title, 'reference': motion.reference,
                'yardstick': motion.error_key, 'method': method.name, 'label': method.label,
                'family': method.family, 'substeps': method.substeps,
                'cpu_s_per_s': result.cpu_s_per_s, 'reading_s_per_s': result.reading_s_per_s,
                'tick_p99_s': float(np.percentile(result.costs, 99)),
                'finite': trajectory.finite, **compare(trajectory, truth)}
    row['energy_excess'] = metrics.energy_excess(trial, trajectory)
    row['joint_gap_m'] = metrics.joint_gap(trajectory)
    row['limit_overshoot_rad'] = metrics.overshoot(trajectory)
    if trial.scene.ground is not None:
        row['sinking_m'] = metrics.penetration(trajectory)
    if motion.in_flight:
        row['momentum_drift'] = metrics.momentum_drift(trial, trajectory)
        if not trial.pushes:
            row['angular_momentum_drift'] = metrics.angular_momentum_drift(trajectory)
    return {**row, **motion.extra(trajectory)}
