"""Pushes: a constant force and torque on a bone for a time."""
import math
from dataclasses import dataclass

import numpy as np

from . import errors, rotation
from .errors import set_fields
from .vectors import Vector, finite_floats

MAX_LOAD = 1e7
"""N and N m, largest force and torque of a push: far beyond what a body of this package meets."""

ARROW_LENGTH = 0.5
"""m, length of the arrow of 1 kN; others are in proportion to the square root of the force."""


def check_times(duration: float, start: float | None) -> None:
    """Check the duration (s) and start (s, or None) of a push or drive."""
    errors.check_positive('duration', duration)
    errors.check_range('duration', duration, 0, 1e6)
    if start is not None:
        errors.check_range('start', start, 0, 1e9)


@dataclass(frozen=True)
class Push:
    """A constant force and torque on one bone.

    Args:
        bone: its name in Scene.bone_names.
        force, torque: (3,) N, (3,) N m, world axes.
        point: (3,) m, where the force acts, from the bone's centre of mass along the world's axes
            as it starts; the point moves with the bone.
        duration: s of simulated time.
        start: s of simulated time; None: when it is given to Simulation.push.
        local: whether force, torque and point are in the bone's axes and turn with it.

    Raises:
        OutOfRange, NotPositive, NotFinite, WrongForm: for its fields.

    Example:
        >>> Push('torso', force=(500, 0, 0), duration=0.2).force
        (500.0, 0.0, 0.0)
    """

    bone: str
    force: Vector = (0.0, 0.0, 0.0)
    torque: Vector = (0.0, 0.0, 0.0)
    point: Vector = (0.0, 0.0, 0.0)
    duration: float = 0.1
    start: float | None = None
    local: bool = False

    def __post_init__(self) -> None:
        for key in ('force', 'torque', 'point'):
            set_fields(self, **{key: finite_floats(key, getattr(self, key))})
        for key in ('force', 'torque'):
            if math.hypot(*getattr(self, key)) > MAX_LOAD:
                raise errors.OutOfRange(key, getattr(self, key), f'a norm of at most {MAX_LOAD:g}')
        check_times(self.duration, self.start)

    def arrow(self, position: np.ndarray, orientation: np.ndarray) -> np.ndarray:
        """Tail and tip (2, 3) m, world frame, of an arrow that ends where the force acts.

        ``position`` (3,) m and ``orientation`` (4,) are the bone's pose.
        """
        force, point = np.array(self.force), np.array(self.point)
        if self.local:
            force, point = rotation.rotate(orientation, np.stack([force, point]))
        strength = float(np.linalg.norm(force))
        length = ARROW_LENGTH * (strength / 1000) ** 0.5
        tip = position + point
        return np.stack([tip - force * (length / max(strength, 1e-300)), tip])
