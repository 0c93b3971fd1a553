"""A trial with its exact solution."""
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
    """A trial with an exact solution."""

    name: str
    title: str
    reference: str
    """Source of the truth, for the report."""
    trial: Trial
    truth: Callable[[np.ndarray], Trajectory]
    """The exact solution at instants (t,) s."""
    error_key: str = 'position_worst_m'
    """The error that is plotted, a key of metrics.compare."""
    in_flight: bool = True
    """Whether there are no contacts, so that momentum is conserved."""
    extra: Callable[[Trajectory], dict[str, float]] = lambda _: {}
    """Returns additional figures of this motion."""


def orientations_about(axis: tuple[float, float, float], angles: np.ndarray) -> np.ndarray:
    """Orientations (t, n, 4) of bones rotated by ``angles`` (t, n) rad about a unit axis."""
    return rotation.from_rotation_vector(np.asarray(angles)[..., None] * np.array(axis))


def without_limits(doll: Ragdoll) -> Ragdoll:
    """The same doll without joint limits, which the reference does not model."""
    return dataclasses.replace(doll, joints=tuple(
        dataclasses.replace(joint, limits=()) for joint in doll.joints))


def without_damping(doll: Ragdoll) -> Ragdoll:
    """The same doll without joint damping: its energy is conserved in flight."""
    return dataclasses.replace(doll, joints=tuple(
        dataclasses.replace(joint, damping=0.0) for joint in doll.joints))


def airborne_scene(doll: Ragdoll, gravity: tuple[float, float, float] = (0.0, 0.0, -9.8),
                   **placed: object) -> Scene:
    """A scene of one doll without ground and self-collision."""
    return Scene(doll.name, (Placement(doll, **placed),), gravity=gravity, self_collision=False)
