"""Grabs: hands that hold points of bones by springs of limited force.

A hand moves to each target at constant velocity, which smooths pointer events of 20 Hz. The spring
between hand and point has stiffness k = M w^2 and damping c = 2 M w, M the doll's mass: a doll that
hangs from it is critically damped and sags by g / w^2.
"""
import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...model import errors
from ...model.scene import Scene
from ...model.scene_change import SceneChange
from ...model.state import State
from ...model.vectors import Vector, floats
from ..engine.protocol import Spring
from ..rigid_body import point_motion

FREQUENCY = 30.0
"""rad/s, w: a doll follows within 0.2 s (up to e^-6 of the distance) and sags by 11 mm."""

MAX_FORCE = 2000.0
"""N: force limit of a hand."""

MAX_ACCELERATION = 40.0
"""m/s^2: limit of the acceleration of a whole doll, about four times its weight."""

REACH = 2.0
"""Largest distance of the held point from the bone's centre, in distances of the bone's farthest
corner: skins are wider than bones, but a long lever would break joints."""

MAX_COORDINATE = 1e6
"""m: bound on each coordinate of a point or a target."""

MAX_HANDS = 20
"""Hands that hold something at once."""

DRAG_TIME = 0.05
"""s: default duration of a hand's movement, the period of 20 Hz pointer events."""


@dataclass(frozen=True)
class Grab:
    """A held ``point`` (m, in the bone's frame) and the hand's ``target`` (m, world frame)."""

    hand: str
    bone: str
    point: Vector
    target: Vector


class Hands:
    """The hands of a scene that hold something."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._springs: dict[str, Spring] = {}

    @property
    def grabs(self) -> tuple[Grab, ...]:
        """Active grabs, oldest first."""
        return tuple(Grab(name, self._scene.bone_names[spring.bone], tuple(spring.point.tolist()),
                          tuple(spring.target.tolist())) for name, spring in self._springs.items())

    @property
    def springs(self) -> tuple[Spring, ...]:
        """Springs of the hands for Engine.advance()."""
        return tuple(self._springs.values())

    def grab(self, name: str, bone: str, point: Sequence[float],
             target: Sequence[float] | None, state: State) -> None:
        """Attach a hand to a point of a bone; see Simulation.grab()."""
        index = self._scene.bone_index(bone)
        held = np.array(checked_point('point', point))
        reach = REACH * math.hypot(*self._scene.bones[index].shape.half_extents)
        if math.hypot(*held) > reach:
            raise errors.OutOfRange('point', point, f'at most {reach:.3g} m from the centre')
        now, _ = point_motion(state, index, held)
        aim = now if target is None else np.array(checked_point('target', target))
        self.let_go(name)
        if len(self._springs) >= MAX_HANDS:
            raise errors.OutOfRange('hands', MAX_HANDS + 1, f'at most {MAX_HANDS}')
        mass = self._scene.dolls[self._scene.doll_of_bone[index]].doll.mass
        self._springs[name] = Spring(
            index, held, now, aim, 0.0 if target is None else DRAG_TIME, mass * FREQUENCY ** 2,
            2 * mass * FREQUENCY, min(MAX_FORCE, MAX_ACCELERATION * mass))

    def drag(self, name: str, target: Sequence[float], within: float) -> None:
        """Move a hand; see Simulation.drag()."""
        aim = np.array(checked_point('target', target))
        errors.check_range('within', within, 0.0, 1e6)
        if name in self._springs:
            self._springs[name] = dataclasses.replace(self._springs[name], target=aim, left=within)

    def let_go(self, name: str) -> None:
        """Detach a hand."""
        self._springs.pop(name, None)

    def change_scene(self, change: SceneChange) -> None:
        """Let go of dolls that are gone."""
        self._scene = change.after
        bones = {name: int(change.new_bones[spring.bone]) for name, spring in self._springs.items()}
        self._springs = {name: dataclasses.replace(spring, bone=bones[name])
                         for name, spring in self._springs.items() if bones[name] >= 0}

    def move(self, duration: float) -> None:
        """Advance the hands' positions by ``duration`` s."""
        if self._springs:
            self._springs = {name: spring.after(duration)
                             for name, spring in self._springs.items()}


def checked_point(name: str, values: Sequence[float]) -> Vector:
    """A point (3,) m. Raises NotFinite, OutOfRange."""
    values = floats(values)
    errors.check_finite(name, values)
    if len(values) != 3 or max(map(abs, values)) > MAX_COORDINATE:
        raise errors.OutOfRange(name, values, f'three numbers (m) up to {MAX_COORDINATE:g}')
    return values
