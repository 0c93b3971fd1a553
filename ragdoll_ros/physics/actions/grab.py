"""Grabs: hands that hold points of bones by springs of limited force.

A hand is where it was told to be, reached evenly, so that twenty pointer events a second do not
jerk. Between it and the point it holds is a spring of stiffness k = M w^2 with the damping
c = 2 M w, M the doll's mass: hung by it, the doll is critically damped and sags by g / w^2.
"""
from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...model import errors
from ...model.scene import Scene
from ...model.state import State
from ...model.vectors import Vector, floats
from ..engine.protocol import Spring
from ..motion import point_motion

FREQUENCY = 30.0
"""rad/s, w: a doll follows within 0.2 s (e^-6 of the way is left) and sags by 11 mm."""

LARGEST_PULL = 2000.0
"""N that a hand pulls with at the most."""

LARGEST_ACCELERATION = 40.0
"""m/s^2 that a hand may give a whole doll: four times its weight. Light dolls get no more."""

REACH = 2.0
"""Distances of a bone's centre from its farthest corner within which a hand may hold it: a skin
is wider than its bones, but a lever of any length would break joints."""

FARTHEST = 1e6
"""m from the world's origin that a hand may be."""

MOST_HANDS = 20
"""Hands that may hold something at once; one more is refused."""

EVENLY = 0.05
"""s within which a hand gets where it shall be: the time between two of 20 events a second."""


@dataclass(frozen=True)
class Grab:
    """What a hand holds: a ``point`` (m, from the bone's centre of mass along the bone's axes),
    and the ``target`` (m, world) that the hand was told to be at.
    """

    hand: str
    bone: str
    point: Vector
    target: Vector


class Hands:
    """All hands of a scene that hold something; false if there is none."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._springs: dict[str, Spring] = {}

    @property
    def grabs(self) -> tuple[Grab, ...]:
        """What is held, the longest held first."""
        return tuple(Grab(name, self._scene.bone_names[spring.bone], tuple(spring.point.tolist()),
                          tuple(spring.target.tolist())) for name, spring in self._springs.items())

    @property
    def springs(self) -> tuple[Spring, ...]:
        """The springs by which they pull now."""
        return tuple(self._springs.values())

    def grab(self, name: str, bone: str, point: Sequence[float],
             target: Sequence[float] | None, state: State) -> None:
        """Let a hand hold a point of a bone. Raises UnknownBone, NotFinite or OutOfRange."""
        index = self._scene.bone_index(bone)
        held = np.array(_checked('point', point))
        reach = REACH * math.hypot(*self._scene.bones[index].shape.half_extents)
        if math.hypot(*held) > reach:
            raise errors.OutOfRange('point', point, f'at most {reach:.3g} m from the centre')
        now, _ = point_motion(state, index, held)
        aim = now if target is None else np.array(_checked('target', target))
        self.let_go(name)
        if len(self._springs) >= MOST_HANDS:
            raise errors.OutOfRange('hands', MOST_HANDS + 1, f'at most {MOST_HANDS}')
        mass = self._scene.dolls[self._scene.doll_of_bone[index]].doll.mass
        self._springs[name] = Spring(
            index, held, now, aim, 0.0 if target is None else EVENLY, mass * FREQUENCY ** 2,
            2 * mass * FREQUENCY, min(LARGEST_PULL, LARGEST_ACCELERATION * mass))

    def drag(self, name: str, target: Sequence[float], within: float) -> None:
        """Move a hand; one that holds nothing holds nothing still."""
        aim = np.array(_checked('target', target))
        errors.check_range('within', within, 0.0, 1e6)
        if name in self._springs:
            self._springs[name] = dataclasses.replace(self._springs[name], target=aim, left=within)

    def let_go(self, name: str) -> None:
        """Open a hand."""
        self._springs.pop(name, None)

    def move(self, duration: float) -> None:
        """Let all hands go on by ``duration`` s."""
        self._springs = {name: spring.after(duration) for name, spring in self._springs.items()}


def _checked(name: str, values: Sequence[float]) -> Vector:
    values = floats(values)
    errors.check_finite(name, values)
    if len(values) != 3 or max(map(abs, values)) > FARTHEST:
        raise errors.OutOfRange(name, values, f'three numbers (m) up to {FARTHEST:g}')
    return values
