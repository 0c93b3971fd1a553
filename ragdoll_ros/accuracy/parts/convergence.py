"""Error against step size on motions with contacts: whether an engine converges to the truth.

Self-convergence proves less: an engine may converge to another restitution or to compliant
contacts. So the difference to its own finest run is only given in addition.
"""
from __future__ import annotations

import functools

from .. import step_sizes
from ..methods import Method, bullet, core, mujoco, run
from ..metrics import compare
from ..motions.contact import contact_motions
from ..motions.impacts import impact_motions
from ..motions.planar_doll import planar_motions
from ..results.runner import Job, Row, RunOptions
from .orders import slope
from .work_precision import motions

NAME = 'convergence'
HALVINGS = 6
"""Step sizes from h down to h / 64."""

QUICK_MOTIONS = ('bounce', 'rod_slides', 'rocking_block', 'planar_ice')
FLOOR = 1e-11
"""m or rad: smaller errors are those of the reference, or rounding."""


def jobs(options: RunOptions) -> list[Job]:
    """One job for each motion with contacts."""
    names = [motion.name for make in (contact_motions, impact_motions, planar_motions)
             for motion in make()]
    chosen = [name for name in names if not options.quick or name in QUICK_MOTIONS]
    return [Job(NAME, f'convergence, {name}', functools.partial(
        measure, name, 4 if options.quick else HALVINGS),
        1 + 2 * motions()[name].trial.duration) for name in chosen]


def families(halvings: int) -> dict[str, list[Method]]:
    """Engines with successively halved steps, the coarsest first.

    The rigid engine begins at the step of `draft`, the others at one substep per tick.
    """
    counts = [2 ** k for k in range(halvings + 1)]
    found = {'PyBullet': [*map(bullet, counts)],
             'MuJoCo implicitfast': [mujoco('implicitfast', count) for count in counts]}
    if step_sizes.has_rigid_engine():
        first = step_sizes.contact_step('draft')
        return {'core': [core(first / count) for count in counts], **found}
    return found


def measure(motion_name: str, halvings: int) -> list[Row]:
    """Errors of a motion at all step sizes, against the truth and the engine's finest run."""
    motion, rows = motions()[motion_name], []
    truth = motion.truth(motion.trial.times())
    for family, methods in families(halvings).items():
        steps = [_step(method) for method in methods]
        found = [run(method, motion.trial).trajectory for method in methods]
        errors, own = ([compare(trajectory, exact)[motion.error_key] for trajectory in found]
                       for exact in (truth, found[-1]))
        rows.append({'motion': motion_name, 'title': motion.title, 'label': family,
                     'yardstick': motion.error_key, 'steps_s': steps, 'errors': errors,
                     'own': own[:-1], **slope(tuple(steps), errors, FLOOR)})
    return rows


def _step(method: Method) -> float:
    return step_sizes.TICK / method.substeps if method.substeps else float(
        method.name.removeprefix('core-'))
