"""Pushes: a force and a torque on a bone, at a point, from when, for how long."""
from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from . import errors, rotation
from .errors import set_fields
from .vectors import Vector, finite_floats

MAX_LOAD = 1e7
"""N and N m: beyond it a push is refused, as no body that this package is for meets it."""

ARROW_LENGTH = 0.5
"""m: length of the arrow of a push of 1 kN; longer and shorter ones go by the square root."""


def check_times(duration: float, start: float | None) -> None:
    """Check for how long, s, and from when on, s or None, something acts; see Push."""
    errors.check_positive('duration', duration)
    errors.check_range('duration', duration, 0, 1e6)
    if start is not None:
        errors.check_range('start', start, 0, 1e9)


@dataclass(frozen=True)
class Push:
    """A steady ``force`` (N) and ``torque`` (N m) on one bone.

    ``point`` (m) is where the force attacks, from the bone's centre of mass. With ``local``,
    force, torque and point are given along the bone's own axes and turn with it; otherwise
    force and torque are along the world's axes, and the point keeps to the bone all the same.
    It acts for ``duration`` s of simulated time from ``start`` s (None: from the next instant).
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
                raise errors.OutOfRange(key, getattr(self, key), f'at most {MAX_LOAD:g} long')
        check_times(self.duration, self.start)

    def arrow(self, position: np.ndarray, orientation: np.ndarray) -> np.ndarray:
        """Tail and tip (2, 3) m, world frame, of an arrow that ends where the force attacks.

        The bone's centre of mass is at ``position`` (3,) m, its axes at ``orientation`` (4,).
        """
        force, point = np.array(self.force), np.array(self.point)
        if self.local:
            force, point = rotation.rotate(orientation, np.stack([force, point]))
        strength = float(np.linalg.norm(force))
        length = ARROW_LENGTH * (strength / 1000) ** 0.5
        tip = position + point
        return np.stack([tip - force * (length / max(strength, 1e-300)), tip])
