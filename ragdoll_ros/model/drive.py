"""Drives: velocity controllers of a bone, with limited force and torque."""
import math
from dataclasses import dataclass

from . import errors
from .errors import set_fields
from .push import MAX_LOAD, Push, check_times
from .vectors import Vector, clamp_norm, finite_floats

MAX_SPEED = 1e3
"""m/s and rad/s, largest target velocities."""

FORCE_PER_SPEED, MAX_FORCE = 4000.0, 2000.0
"""N/(m/s) and N: enough to move a doll of 55 kg that lies on ground without slip."""

TORQUE_PER_SPEED, MAX_TORQUE = 1000.0, 600.0
"""N m/(rad/s) and N m: enough to turn it."""


@dataclass(frozen=True)
class Drive:
    """A proportional velocity controller of one bone: force = gain * velocity error, limited.

    Args:
        bone: its name in Scene.bone_names.
        velocity: (3,) m/s, target of the centre of mass, world axes; None: no force.
        angular_velocity: (3,) rad/s, target, world axes; None: no torque.
        force_per_speed, most_force: N/(m/s), gain, and N, limit; at the centre of mass.
        torque_per_speed, most_torque: N m/(rad/s), gain, and N m, limit.
        duration: s of simulated time.
        start: s of simulated time; None: when it is given to Simulation.push.

    Raises:
        OutOfRange, NotPositive, NotFinite, WrongForm: for its fields.

    Example:
        >>> Drive('torso', velocity=(1, 0, 0)).at_rest.force
        (2000.0, 0.0, 0.0)
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
                raise errors.OutOfRange(key, getattr(self, key), f'a norm of at most {MAX_SPEED:g}')
        for key in ('force_per_speed', 'torque_per_speed', 'most_force', 'most_torque'):
            errors.check_range(key, getattr(self, key), 0, MAX_LOAD)
        check_times(self.duration, self.start)

    @property
    def at_rest(self) -> Push:
        """Its push on a bone at rest."""
        return Push(self.bone, _at_most(self.most_force, self.force_per_speed, self.velocity),
                    _at_most(self.most_torque, self.torque_per_speed, self.angular_velocity),
                    duration=self.duration, start=self.start)


def _at_most(most: float, gain: float, missing: Vector | None) -> Vector:
    return clamp_norm([gain * value for value in missing or (0.0, 0.0, 0.0)], most)[0]
