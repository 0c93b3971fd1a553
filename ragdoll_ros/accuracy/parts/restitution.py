"""Single bodies that bounce: whether they come back as high as their restitution says."""
from __future__ import annotations

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
"""m/s of approach, down to which each flight counts."""

MOST = 12
"""Flights of a body that never comes to rest."""

TICK, FINE_TICK = 0.01, 0.002
"""s. Ours in fine ticks, so that few flights fall between two; the others in those whose substeps
their names count."""

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
    """Worst error of the heights of all flights, and e by the first, for each body and e."""
    method, rows = by_name(name), []
    for body, restitution in itertools.product(bodies, restitutions):
        flights = counted(restitution)
        trial = dropped(BODIES[body], restitution, flights,
                        FINE_TICK if method.family in ('ours', 'core') else TICK)
        shares = apex_shares(run(method, trial).trajectory, BODIES[body], flights, restitution)
        rows.append({'method': name, 'label': method.label, 'body': body,
                     'restitution': restitution, 'flights': len(flights) - 1,
                     'seen': len(shares),
                     'worst': max((abs(share - 1) for share in shares), default=math.nan),
                     'found': restitution * math.sqrt(max(0.0, shares[0])) if shares else math.nan})
    return rows


def counted(restitution: float) -> list[float]:
    """Instants, s, of the impacts that count, and of the one after them."""
    fall = math.sqrt(2 * GRAVITY * HEIGHT)
    count = MOST
    if restitution < 1:
        count = 1 + math.floor(math.log(SLOWEST / fall) / math.log(restitution))
    return bounce_times(HEIGHT, restitution, GRAVITY, min(count, 60) + 1)


def dropped(shape: Shape, restitution: float, flights: list[float], tick: float) -> Trial:
    """A body let go level, 1 m above the ground."""
    doll = Ragdoll('body', (Bone('body', shape, 1.0, (0.0, 0.0, 0.0)),))
    up = float(shape.reach(np.array((0.0, 0.0, -1.0))))
    scene = Scene('bounce', (Placement(doll, position=(0.0, 0.0, up + HEIGHT)),), Ground(),
                  Material(0.0, 0.0, restitution), step=tick)
    return Trial(scene, (math.ceil(flights[-1] / tick) + 1) * tick)


def apex_shares(trajectory: Trajectory, shape: Shape, flights: list[float],
                restitution: float) -> list[float]:
    """Height of each flight over e^(2 n) h, by z + v^2 / 2 g in the middle of the flight.

    Flights between two ticks are not seen.
    """
    up = float(shape.reach(np.array((0.0, 0.0, -1.0))))
    height = (trajectory.positions[:, 0, 2] - up
              + trajectory.linear_velocities[:, 0, 2] ** 2 / (2 * GRAVITY))
    shares = []
    for n, (begin, end) in enumerate(itertools.pairwise(flights), start=1):
        middle = int(np.argmin(np.abs(trajectory.times - (begin + end) / 2)))
        if abs(trajectory.times[middle] - (begin + end) / 2) < 0.4 * (end - begin):
            shares.append(float(height[middle]) / (HEIGHT * restitution ** (2 * n)))
    return shares
