"""Nine classes of random starts of the default doll above the ground, reproducible.

A start is determined by its class and number. Pushes act on the default scene. In the other classes
joint angles are drawn from the inner part of their ranges, so that no bones overlap, but `start
outside` then moves half of them past a limit; the height of the lowest point is exact.
"""
import dataclasses
import functools
import math
from collections.abc import Callable

import numpy as np

from ...files.scene import load_scene
from ...model import rotation
from ...model.coordinates import GeneralizedState
from ...model.push import Push
from ...model.scene import Placement, Scene, height
from ..references.articulated import Articulated
from .trial import Trial, angle_indices, angle_limits, inner_angles, posed

SETTLING = 2.0
"""s simulated after the first contact."""


@functools.cache
def drop() -> Scene:
    """The default scene, cached."""
    return load_scene('drop')


def trial(class_name: str, number: int) -> Trial:
    """Start ``number`` of a class."""
    rng = np.random.default_rng([list(CLASSES).index(class_name), number])
    return CLASSES[class_name](rng)


def _push(rng: np.random.Generator) -> Trial:
    """A horizontal push of 2000 N on the torso, as by the arrow keys, for 0.1 to 3 s."""
    scene = drop()
    heading = rng.uniform(0, 2 * math.pi)
    force = (2000 * math.cos(heading), 2000 * math.sin(heading), 1.0)
    start, duration = round(rng.uniform(0, 1), 2), round(rng.uniform(0.1, 3.0), 2)
    push = Push('torso', force, start=start, duration=duration)
    return Trial(scene, round(start + duration + 1.5, 2), None, (push,))


def _spin(speed: float) -> Callable[[np.random.Generator], Trial]:
    """A rigid rotation about a random axis, 2 m above the ground."""
    def make(rng: np.random.Generator) -> Trial:
        axis = rotation.normalized(rng.normal(size=3))
        angles = inner_angles(drop().dolls[0].doll, rng)
        return _released(rng, 2.0, angles, spin=tuple(speed * axis))
    return make


def _drop(fall: float) -> Callable[[np.random.Generator], Trial]:
    """A drop from rest at a random orientation."""
    def make(rng: np.random.Generator) -> Trial:
        return _released(rng, fall, inner_angles(drop().dolls[0].doll, rng))
    return make


def _slam(rng: np.random.Generator) -> Trial:
    """Every joint moves towards one of its limits at 10 to 20 rad/s."""
    doll = drop().dolls[0].doll
    rates = {name: rng.choice((-1, 1)) * rng.uniform(10, 20) for name in angle_indices(doll)}
    return _released(rng, 0.4, inner_angles(doll, rng), rates)


def _outside(rng: np.random.Generator) -> Trial:
    """On average half of the joint angles 5 to 30 degrees past a limit."""
    doll = drop().dolls[0].doll
    angles = inner_angles(doll, rng)
    for name, (lower, upper) in angle_limits(doll).items():
        if rng.random() < 0.5:
            past = math.radians(rng.uniform(5, 30))
            angles[name] = upper + past if rng.random() < 0.5 else lower - past
    return _released(rng, 0.4, angles)


CLASSES: dict[str, Callable[[np.random.Generator], Trial]] = {
    'push .1 to 3 s': _push, 'spin 10 rad/s': _spin(10.0), 'spin 20 rad/s': _spin(20.0),
    'drop .4 m': _drop(0.4), 'drop 2 m': _drop(2.0), 'drop 10 m': _drop(10.0),
    'drop 50 m': _drop(50.0), 'limit slam': _slam, 'start outside': _outside}


def _released(rng: np.random.Generator, fall: float, angles: dict[str, float],
              rates: dict[str, float] | None = None, **moving: object) -> Trial:
    """The doll at a random orientation, its lowest point ``fall`` m above the ground."""
    scene = drop()
    orientation = tuple(rotation.normalized(rng.normal(size=4)))
    placement = Placement(scene.dolls[0].doll, orientation=orientation, **moving)
    start = lifted(scene, posed(placement, angles, rates), fall)
    scene = dataclasses.replace(scene, dolls=(placement,))
    duration = math.sqrt(2 * fall / 9.8) + SETTLING
    return Trial(scene, round(duration, 2), start)


def lifted(scene: Scene, start: GeneralizedState, clearance: float) -> GeneralizedState:
    """Move ``start`` in place until the lowest point of all bones is ``clearance`` m above level
    ground; returns it.
    """
    doll = scene.dolls[0].doll
    state = Articulated(doll).state(start.q, start.v)
    lowest = min(height(bone, position, orientation, scene.ground)
                 for bone, position, orientation
                 in zip(doll.bones, state.positions, state.orientations, strict=True))
    start.q[2] += clearance - lowest
    return start
