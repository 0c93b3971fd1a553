"""A trial together with the truth about it."""
from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...model import rotation
from ...model.ragdoll import Ragdoll
from ...model.scene import Placement, Scene
from ..cases.trial import Trial
from ..trajectory import Trajectory


@dataclass(frozen=True)
class ReferenceMotion:
    """A trial whose exact course is known."""

    name: str
    title: str
    reference: str
    """Where the truth comes from, for the report."""
    trial: Trial
    truth: Callable[[np.ndarray], Trajectory]
    """The exact course at given instants (t,) s."""
    yardstick: str = 'position_worst_m'
    """The error that is plotted."""
    in_air: bool = True
    """Whether nothing ever touches, so that momentum is kept."""
    extra: Callable[[Trajectory], dict[str, float]] = lambda _: {}
    """Further figures of this motion alone."""


def orientations_about(axis: tuple[float, float, float], angles: np.ndarray) -> np.ndarray:
    """Orientations (t, n, 4) of bones rotated by ``angles`` (t, n) rad about a unit axis."""
    return rotation.from_rotation_vector(np.asarray(angles)[..., None] * np.array(axis))


def without_limits(doll: Ragdoll) -> Ragdoll:
    """The same doll with all joints free: the reference knows no limits."""
    return dataclasses.replace(doll, joints=tuple(
        dataclasses.replace(joint, limits=()) for joint in doll.joints))


def without_damping(doll: Ragdoll) -> Ragdoll:
    """The same doll with joints that lose nothing: its energy is a constant of flight."""
    return dataclasses.replace(doll, joints=tuple(
        dataclasses.replace(joint, damping=0.0) for joint in doll.joints))


def airborne_scene(doll: Ragdoll, gravity: tuple[float, float, float] = (0.0, 0.0, -9.8),
                   **placed: object) -> Scene:
    """A scene of one doll in the air, whose bones pass through each other."""
    return Scene(doll.name, (Placement(doll, **placed),), gravity=gravity, self_collision=False)
