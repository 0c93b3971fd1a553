"""A hard trial and its requirements."""
from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass

from ...model import rotation
from ...model.ragdoll import Ragdoll
from ...model.scene import Placement, above_ground
from .trial import Trial, posed

OVERSHOOT = math.radians(0.2)
SINKING = 1e-3
"""Bounds at the accuracy `normal`: overshoot, rad; penetration of ground and of bones, m."""


@dataclass(frozen=True)
class Requirements:
    """Bounds besides those for all cases: no NaN, no energy gain, no joint gaps, no stop.

    None: no bound. Bounds in m scale with dolls larger than the default one.
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
    """A drop from rest by ``fall`` m, slightly tilted so that nothing stands by symmetry."""
    scene = above_ground(doll, fall)
    _, _, up = scene.dolls[0].position
    turn = tuple(rotation.from_rpy(0.03, 0.05, 0.0))
    placement = Placement(doll, position=(*at, up), orientation=turn, **placed)
    scene = dataclasses.replace(scene, dolls=(placement,), step=tick)
    return Trial(scene, round(duration / tick) * tick, posed(placement) if placed else None)
