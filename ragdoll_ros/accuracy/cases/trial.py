"""A trial: scene, initial state, pushes and duration, to be simulated by every method."""
from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from ...model.coordinates import GeneralizedState
from ...model.push import Push
from ...model.ragdoll import Ragdoll
from ...model.scene import Placement, Scene
from ...physics.engine.protocol import AppliedWrench
from ..references.articulated import Articulated


@dataclass(frozen=True)
class Trial:
    """``duration`` s of a scene, from ``start`` or from the scene's own initial state.

    Pushes have a start, begin and end with a tick, and act along the world's axes.
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
    for name, angle in (angles or {}).items():
        q[7 + where[name]] = angle
    for name, rate in (rates or {}).items():
        v[6 + where[name]] = rate
    return GeneralizedState(q, v)


def angle_indices(doll: Ragdoll) -> dict[str, int]:
    """Index of each joint angle after the root's coordinates, for dolls without free balls."""
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
