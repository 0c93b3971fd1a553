"""A trial that breaks simulations, and what must hold all the same."""
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
"""rad and m: what the setting normal promises, of the ground and of bones in bones."""


@dataclass(frozen=True)
class Requirements:
    """What must hold, on top of: no NaN, no energy from nothing, no gaps, no stop.

    None: no bound. Bounds in m scale with the doll where it is larger than the default one.
    """

    sinking_m: float | None = SINKING
    depth_m: float | None = SINKING
    """Of a bone in another; pairs that start in each other count from when they are apart."""
    overshoot_rad: float | None = OVERSHOOT
    rest: bool = True
    """Whether all bones must be slower than 0.05 m/s (times the root of the scale) at the end."""
    lift_m: float = 0.0
    """How far the ground may lift the doll out of itself: that energy is the start's own."""
    max_speed_m_s: float | None = None
    """Fastest any bone may ever be."""
    max_momentum_drift: float | None = None
    """Share of the momentum and of the angular momentum that may be lost in the air."""
    max_displacement_m: float | None = None
    """How far any bone may be from its start at the end."""


@dataclass(frozen=True)
class HardCase:
    """A trial and its rule."""

    name: str
    make: Callable[[], Trial]
    rule: Requirements = Requirements()
    scale: float = 1.0
    """Size of the doll over that of the default one."""
    reason: str = ''
    """Why it may fail and what was tried: shown only where it does fail."""


def drop(doll: Ragdoll, fall: float = 0.4, duration: float = 8.0, tick: float = 0.01,
         at: tuple[float, float] = (0.0, 0.0), **placed: object) -> Trial:
    """A fall from rest, slightly tilted so that nothing stands by symmetry."""
    scene = above_ground(doll, fall)
    _, _, up = scene.dolls[0].position
    turn = tuple(rotation.from_rpy(0.03, 0.05, 0.0))
    placement = Placement(doll, position=(*at, up), orientation=turn, **placed)
    scene = dataclasses.replace(scene, dolls=(placement,), step=tick)
    return Trial(scene, round(duration / tick) * tick, posed(placement) if placed else None)
