"""Drives: a velocity that a bone is pushed towards, from when, for how long."""
from __future__ import annotations

import math
from dataclasses import dataclass

from . import errors
from .errors import set_fields
from .push import MAX_LOAD, Push, check_times
from .vectors import Vector, clamp_norm, finite_floats

MAX_SPEED = 1e3
"""m/s and rad/s: beyond it a drive is refused."""

FORCE_PER_SPEED, MAX_FORCE = 4000.0, 2000.0
"""N/(m/s) and N: with less, a doll of 55 kg that lies where nothing slides is hardly moved."""

TORQUE_PER_SPEED, MAX_TORQUE = 1000.0, 600.0
"""N m/(rad/s) and N m: likewise for turning it."""


@dataclass(frozen=True)
class Drive:
    """Pushes one bone towards a velocity, with what is missing times a gain.

    Towards ``velocity`` (m/s) of its centre of mass by a force there of ``force_per_speed``
    N/(m/s), ``most_force`` N at the most; towards ``angular_velocity`` (rad/s) by a torque of
    ``torque_per_speed`` N m/(rad/s), ``most_torque`` N m at the most; all along the world's axes.
    None leaves it free to move, or to turn. It acts for ``duration`` s of simulated time from
    ``start`` s (None: from the next instant).
    """

    bone: str
    velocity: Vector | None = None
    angular_velocity: Vector | None = None
    force_per_speed: float = FORCE_PER_SPEED
    torque_per_speed: float = TORQUE_PER_SPEED
    most_force: float = MAX_FORCE
    most_torque: float = MAX_TORQUE
    duration: float = 0.6
    start: float | None = None

    def __post_init__(self) -> None:
        for key in ('velocity', 'angular_velocity'):
            if getattr(self, key) is None:
                continue
            set_fields(self, **{key: finite_floats(key, getattr(self, key))})
            if math.hypot(*getattr(self, key)) > MAX_SPEED:
                raise errors.OutOfRange(key, getattr(self, key), f'at most {MAX_SPEED:g} long')
        for key in ('force_per_speed', 'torque_per_speed', 'most_force', 'most_torque'):
            errors.check_range(key, getattr(self, key), 0, MAX_LOAD)
        check_times(self.duration, self.start)

    @property
    def at_rest(self) -> Push:
        """The push that it is on a bone at rest."""
        return Push(self.bone, _at_most(self.most_force, self.force_per_speed, self.velocity),
                    _at_most(self.most_torque, self.torque_per_speed, self.angular_velocity),
                    duration=self.duration, start=self.start)


def _at_most(most: float, gain: float, missing: Vector | None) -> Vector:
    return clamp_norm([gain * value for value in missing or (0.0, 0.0, 0.0)], most)[0]
