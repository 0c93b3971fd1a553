"""Motion of a body's frame at constant twist, for TIMEOUT; and the arguments of drive_body()."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...model import errors, rotation
from ...model.drive import MAX_SPEED
from ...model.pose import Pose
from ...model.scene import SECOND
from ...model.vectors import finite_floats, unit_vector
from .grab import checked_point

TIMEOUT = SECOND // 5
"""ns for which a body moves on after its last twist."""

JUMP_SPEED = 10.0
"""m/s: a pose that is farther away than this speed explains in a tick is a jump."""

NEGLIGIBLE = 1e-9
"""m or rad: a body that is this near to its motion has reached it."""

Twist = tuple[np.ndarray, np.ndarray]
"""Velocity (3,) m/s and angular velocity (3,) rad/s, world frame."""

AT_REST: Twist = np.zeros(3), np.zeros(3)


@dataclass
class TwistMotion:
    """Motion of a body's frame at constant twist."""

    pose: Pose
    """At ``since``."""
    twist: Twist
    """Of the frame's origin."""
    since: int
    """ns"""
    told: bool = False
    """Whether anybody has asked for it."""

    def at(self, time: int) -> Pose:
        """Pose of the frame at ``time``, ns."""
        gone = (min(time, self.end) - self.since) / SECOND
        velocity, spin = self.twist
        return Pose(self.pose.position + gone * velocity, rotation.multiply(
            rotation.from_rotation_vector(gone * spin), self.pose.orientation))

    @property
    def end(self) -> int:
        """Time, ns, at which the motion ends and the frame stops."""
        return self.since + TIMEOUT

    def twist_at(self, time: int) -> Twist:
        """Twist of the frame's origin at ``time``, ns."""
        return self.twist if time < self.end else AT_REST


class MotionCommand(NamedTuple):
    """Arguments of Simulation.drive_body() beside the name."""

    pose: Sequence[float] | None = None
    twist: Sequence[float] | None = None
    joint_angles: Mapping[str, float] | None = None
    rates: Mapping[str, float] | None = None

    @property
    def moves_joints(self) -> bool:
        """Whether it says how joints move."""
        return self.joint_angles is not None or self.rates is not None


def checked_pose(values: Sequence[float]) -> Pose:
    """Pose of seven numbers. Raises WrongForm, NotFinite, NotUnit, OutOfRange."""
    numbers = finite_floats('pose', values, 7)
    return Pose(np.array(checked_point('pose', numbers[:3])), np.array(unit_vector(
        'pose', numbers[3:], 'a quaternion x, y, z, w, not zero', 4)))


def checked_twist(values: Sequence[float] | None) -> Twist:
    """Twist of six numbers; None: at rest. Raises WrongForm, NotFinite, OutOfRange."""
    if values is None:
        return AT_REST
    twist = np.array(finite_floats('twist', values, 6))
    for part in (twist[:3], twist[3:]):
        if np.linalg.norm(part) > MAX_SPEED:
            raise errors.OutOfRange('twist', tuple(twist.tolist()),
                                    f'at most {MAX_SPEED:g} m/s and rad/s')
    return twist[:3], twist[3:]
