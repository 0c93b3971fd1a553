"""Single bodies that bounce: their apexes against the restitution."""
import functools
import itertools
import math

import numpy as np

from ...model.ragdoll import Bone, Ragdoll
from ...model.scene import Ground, Material, Placement, Scene
from ...model.shapes import Box, Capsule, Shape, Sphere
from ...physics.accuracy import ACCURACIES
from ..cases.trial import Trial
from ..methods import by_name, run
from ..references.closed_forms import bounce_times
from ..results.runner import Job, Row, RunOptions
from ..trajectory import Trajectory

NAME = 'restitution'
RESTITUTIONS = tuple(k / 10 for k in range(1, 11))
BODIES: dict[str, Shape] = {'ball': Sphere(0.1), 'box on its face': Box((0.2, 0.3, 0.1)),
                            'upright capsule': Capsule(0.05, 0.2)}
HEIGHT, GRAVITY = 1.0, 9.8
SLOWEST = 0.05
"""Smallest approach speed, m/s, of flights that count."""

MAX_FLIGHTS = 12
"""Flights of a body with restitution 1."""

TICK, FINE_TICK = 0.01, 0.002
"""s. Fine ticks for ours, so that few flights are shorter than a tick; the others have the tick
that their substeps refer to."""

OTHERS = ('bullet-4', 'bullet-10', 'bullet-100', 'mujoco-implicitfast-10')


def jobs(options: RunOptions) -> list[Job]:
    """One job for each method."""
    names = [*(f'ours-{accuracy}' for accuracy in ACCURACIES),
             *(OTHERS[1:2] if options.quick else OTHERS)]
    bodies = tuple(BODIES)[:1] if options.quick else tuple(BODIES)
    restitutions = RESTITUTIONS[::4] if options.quick else RESTITUTIONS
    return [Job(NAME, f'restitution, {name}', functools.partial(measure, name, bodies,
                                                                restitutions),
                0.2 * len(bodies) * len(restitutions)) for name in names]


def measure(name: str, bodies: tuple[str, ...], restitutions: tuple[float, ...]) -> list[Row]:
    """Largest error of the apex heights, and measured restitution, for each body and
    restitution.
    """
    method, rows = by_name(name), []
    for body, restitution in itertools.product(bodies, restitutions):
        flights = impact_times(restitution)
        trial = dropped(BODIES[body], restitution, flights,
                        FINE_TICK if method.family in ('ours', 'core') else TICK)
        shares = apex_shares(run(method, trial).trajectory, BODIES[body], flights, restitution)
        rows.append({'method': name, 'label': method.label, 'body': body,
                     'restitution': restitution, 'flights': len(flights) - 1, 'seen': len(shares),
                     'worst': max((abs(share - 1) for share in shares), default=math.nan),
                     'found': restitution * math.sqrt(max(0.0, shares[0])) if shares else math.nan})
    return rows


def impact_times(restitution: float) -> list[float]:
    """Times, s, of the impacts that count and of the next one."""
    fall = math.sqrt(2 * GRAVITY * HEIGHT)
    count = MAX_FLIGHTS
    if restitution < 1:
        count = 1 + math.floor(math.log(SLOWEST / fall) / math.log(restitution))
    return bounce_times(HEIGHT, restitution, GRAVITY, min(count, 60) + 1)


def dropped(shape: Shape, restitution: float, flights: list[float], tick: float) -> Trial:
    """A body released level, 1 m above the ground."""
    doll = Ragdoll('body', (Bone('body', shape, 1.0, (0.0, 0.0, 0.0)),))
    up = float(shape.support(np.array((0.0, 0.0, -1.0))))
    scene = Scene('bounce', (Placement(doll, position=(0.0, 0.0, up + HEIGHT)),), Ground(),
                  Material(0.0, 0.0, restitution), step=tick)
    return Trial(scene, (math.ceil(flights[-1] / tick) + 1) * tick)


def apex_shares(trajectory: Trajectory, shape: Shape, flights: list[float],
                restitution: float) -> list[float]:
    """Apex height of each flight, z + v^2 / 2 g at mid-flight, over e^(2 n) h.

    Flights without a tick near the middle are skipped.
    """
    up = float(shape.support(np.array((0.0, 0.0, -1.0))))
    height = (trajectory.positions[:, 0, 2] - up
              + trajectory.linear_velocities[:, 0, 2] ** 2 / (2 * GRAVITY))
    shares = []
    for n, (begin, end) in enumerate(itertools.pairwise(flights), start=1):
        middle = int(np.argmin(np.abs(trajectory.times - (begin + end) / 2)))
        if abs(trajectory.times[middle] - (begin + end) / 2) < 0.4 * (end - begin):
            shares.append(float(height[middle]) / (HEIGHT * restitution ** (2 * n)))
    return shares
