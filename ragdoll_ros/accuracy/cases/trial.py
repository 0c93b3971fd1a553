"""A trial, to be simulated by every method, and a hard case: a trial with requirements."""
from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...model import rotation
from ...model.coordinates import GeneralizedState
from ...model.push import Push
from ...model.ragdoll import Ragdoll
from ...model.scene import Placement, Scene, above_ground
from ...physics.engine.protocol import AppliedWrench
from ..references.articulated import Articulated

OVERSHOOT = math.radians(0.2)
SINKING = 1e-3
"""Bounds at the accuracy `normal`: overshoot, rad; penetration of ground and of bones, m."""


@dataclass(frozen=True)
class Trial:
    """``duration`` s of a scene, from ``start`` or from the scene's own initial state.

    The start time of each push is given. Pushes begin and end with a tick, and act along the
    world's axes.
    """

    scene: Scene
    duration: float
    start: GeneralizedState | None = None
    pushes: tuple[Push, ...] = ()

    def times(self, tick: float | None = None) -> np.ndarray:
        """Instants 0, tick, 2 tick ... (t,) s; the scene's tick if None."""
        tick = tick or self.scene.step
        return np.arange(round(self.duration / tick) + 1) * tick

    def with_tick(self, tick: float) -> Trial:
        """The same trial with another tick, s."""
        return dataclasses.replace(self, scene=dataclasses.replace(self.scene, step=tick))

    def loads(self, begin: float, end: float) -> list[AppliedWrench]:
        """Wrenches of the pushes that act in the middle of a tick from ``begin`` to ``end`` s."""
        middle = (begin + end) / 2
        return [AppliedWrench(self.scene.bone_index(push.bone), np.array(push.force),
                              np.array(push.torque), np.array(push.point))
                for push in self.pushes if push.start <= middle < push.start + push.duration]


def posed(placement: Placement, angles: dict[str, float] | None = None,
          rates: dict[str, float] | None = None) -> GeneralizedState:
    """Coordinates of a placed doll with some joint angles (rad) and rates (rad/s) set by name.

    Names are those of Joint.angle_names; the root has the placement's velocity.
    """
    doll = placement.doll
    tree = Articulated(doll)
    q, v = tree.bind(placement.position, placement.orientation), np.zeros(tree.nv)
    v[:3], v[3:6] = placement.root_velocity(), placement.spin
    where = angle_indices(doll)
    for name, angle in {**placement.angles, **(angles or {})}.items():
        q[7 + where[name]] = angle
    for name, rate in {**placement.rates, **(rates or {})}.items():
        v[6 + where[name]] = rate
    return GeneralizedState(q, v)


def angle_indices(doll: Ragdoll) -> dict[str, int]:
    """Index of each joint angle after the root's coordinates, for dolls without ball joints that
    have no limits.
    """
    names = [name for joint in doll.joints_depth_first() for name in joint.angle_names]
    return {name: place for place, name in enumerate(names)}


def angle_limits(doll: Ragdoll) -> dict[str, tuple[float, float]]:
    """Limits of each joint angle, rad, for dolls whose joints all have limits."""
    return {name: pair for joint in doll.joints
            for name, pair in zip(joint.angle_names, joint.angle_limits, strict=True)}


def inner_angles(doll: Ragdoll, rng: np.random.Generator) -> dict[str, float]:
    """Random joint angles, rad, in the inner two fifths of their ranges."""
    return {name: lower + (upper - lower) * rng.uniform(0.3, 0.7)
            for name, (lower, upper) in angle_limits(doll).items()}


@dataclass(frozen=True)
class Requirements:
    """Bounds besides those for all cases: no NaN, energy gain, joint gap, stop or hanging tick.

    None: no bound. Bounds of penetration scale with dolls larger than the default one.
    """

    sinking_m: float | None = SINKING
    depth_m: float | None = SINKING
    """Penetration of bones; pairs that overlap at the start count once they have separated."""
    overshoot_rad: float | None = OVERSHOOT
    rest: bool = True
    """Whether all bones must end slower than 0.05 m/s, times the square root of the scale."""
    lift_m: float = 0.0
    """Height by which the ground may push the doll out: energy that the start stores."""
    max_speed_m_s: float | None = None
    """Largest speed of any bone at any time."""
    max_momentum_drift: float | None = None
    """Largest relative drift of momentum and angular momentum in the air."""
    max_displacement_m: float | None = None
    """Largest displacement of any bone at the end."""


@dataclass(frozen=True)
class HardCase:
    """A trial and its requirements."""

    name: str
    make: Callable[[], Trial]
    requirements: Requirements = Requirements()
    scale: float = 1.0
    """Size relative to the default doll."""
    reason: str = ''
    """Known cause of a failure, shown if the case fails."""


def drop(doll: Ragdoll, fall: float = 0.4, duration: float = 8.0, tick: float = 0.01,
         at: tuple[float, float] = (0.0, 0.0), **placed: object) -> Trial:
    """A drop by ``fall`` m, slightly tilted so that nothing stands by symmetry; from rest unless
    ``placed``, fields of the Placement, has a velocity.
    """
    scene = above_ground(doll, fall)
    _, _, up = scene.dolls[0].position
    turn = tuple(rotation.from_rpy(0.03, 0.05, 0.0))
    placement = Placement(doll, position=(*at, up), orientation=turn, **placed)
    scene = dataclasses.replace(scene, dolls=(placement,), step=tick)
    return Trial(scene, round(duration / tick) * tick, posed(placement) if placed else None)
