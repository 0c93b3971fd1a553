"""Motors: springs with a torque limit that drive the joints of a doll to a pose or an animation."""
from __future__ import annotations

import math
import operator
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from . import errors, rotation
from .errors import set_fields
from .ragdoll import Bone, Ragdoll, joint_axes

MAX_STIFFNESS = 1e6
"""N m/rad and N m s/rad: a hundred times a person's, and far from loss of precision."""

MAX_FREQUENCY, MAX_DAMPING_RATIO = 1000.0, 100.0
"""Hz, and a ratio: beyond them a motor is no spring any more."""


class Motor(NamedTuple):
    """The motor of a joint angle: stiffness, N m/rad, damping, N m s/rad, and torque limit, N m."""

    stiffness: float
    damping: float
    max_torque: float


@dataclass(frozen=True)
class Motors:
    """Motors on all joint angles of a doll, which drive it to a target pose.

    The torque on an angle is s (k (target - angle) + c (target's rate - rate)), at most s times
    ``max_torque``, with the strength s. Without ``stiffness``, k is such that all bones beyond the
    joint, as one body, would oscillate with ``frequency`` in the bind pose while the parent is
    held; without ``damping``, c gives that oscillation its ``damping_ratio``. This is how Jolt's
    motors and MuJoCo's position actuators (``kp``, ``kv``, ``forcerange``) are set.

    Args:
        frequency: Hz.
        damping_ratio: 1: critical.
        stiffness: k, N m/rad, for all angles, or by their names.
        damping: c, N m s/rad, likewise.
        max_torque: N m, likewise; infinity where none is given.
        strength: s at the start, 0 to 1.

    Raises:
        OutOfRange: for a number that is out of its range, or is not a number (NaN).

    Example:
        >>> Motors(frequency=4, max_torque=80).strength
        1.0
    """

    frequency: float = 5.0
    damping_ratio: float = 1.0
    stiffness: float | Mapping[str, float] = field(default_factory=dict, hash=False)
    damping: float | Mapping[str, float] = field(default_factory=dict, hash=False)
    max_torque: float | Mapping[str, float] = field(default=math.inf, hash=False)
    strength: float = 1.0

    def __post_init__(self) -> None:
        for key, most in (('frequency', MAX_FREQUENCY), ('damping_ratio', MAX_DAMPING_RATIO),
                          ('strength', 1.0)):
            errors.check_range(key, getattr(self, key), 0.0, most)
            set_fields(self, **{key: float(getattr(self, key))})
        for key, most in (('stiffness', MAX_STIFFNESS), ('damping', MAX_STIFFNESS),
                          ('max_torque', math.inf)):
            set_fields(self, **{key: _checked(key, getattr(self, key), most)})

    def of(self, doll: Ragdoll) -> dict[str, Motor]:
        """The motor of each joint angle of a doll, by its name, at strength 1.

        Raises UnknownJoint for a name that the doll does not have. Ball joints without limits,
        whose coordinates are quaternions, have no motors.
        """
        inertias = angle_inertias(doll)
        for key in ('stiffness', 'damping', 'max_torque'):
            given = getattr(self, key)
            for name in given if isinstance(given, Mapping) else ():
                if name not in inertias:
                    raise errors.UnknownJoint(f'{key}.{name}', name,
                                              errors.one_of(list(inertias), name))
        found = {}
        for name, inertia in inertias.items():
            stiffness = _value(self.stiffness, name,
                               inertia * (2 * math.pi * self.frequency) ** 2)
            damping = _value(self.damping, name,
                             2 * self.damping_ratio * math.sqrt(stiffness * inertia))
            found[name] = Motor(min(stiffness, MAX_STIFFNESS), min(damping, MAX_STIFFNESS),
                                _value(self.max_torque, name, math.inf))
        return found


def angle_inertias(doll: Ragdoll) -> dict[str, float]:
    """Moment of inertia, kg m^2, about each joint angle's axis, by its name, of all bones beyond
    the joint as one rigid body in the bind pose: a diagonal element of the mass matrix.
    """
    # Mass, first and second moment about the doll's origin, of each bone with all beyond it.
    beyond = {bone.name: _moments(bone) for bone in doll.bones}
    for joint in reversed(doll.joints_from_root()):
        beyond[joint.parent] = tuple(map(operator.add, beyond[joint.parent], beyond[joint.child]))
    found = {}
    for joint in doll.joints:
        mass, first, second = beyond[joint.child]
        at = np.array(joint.anchor)
        # Steiner's theorem, from the origin to the anchor.
        inertia = second + _spread(at, mass * at - 2 * first)
        for name, axis in zip(joint.angle_names, joint_axes(joint), strict=True):
            if not joint.is_free_ball:
                found[name] = float(axis @ inertia @ axis)
    return found


def _moments(bone: Bone) -> tuple[float, np.ndarray, np.ndarray]:
    turn, center = rotation.matrix(np.array(bone.orientation)), np.array(bone.position)
    return (bone.mass, bone.mass * center,
            turn @ np.diag(bone.inertia) @ turn.T + bone.mass * _spread(center, center))


def _spread(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Inertia about the origin of a unit point mass at a = b; bilinear and symmetric."""
    return float(np.dot(a, b)) * np.eye(3) - (np.outer(a, b) + np.outer(b, a)) / 2


def _checked(key: str, given: float | Mapping[str, float],
             most: float) -> float | dict[str, float]:
    if isinstance(given, Mapping):
        for name, value in given.items():
            errors.check_range(f'{key}.{name}', value, 0.0, most)
        return {name: float(value) for name, value in given.items()}
    errors.check_range(key, given, 0.0, most)
    return float(given)


def _value(given: float | Mapping[str, float], name: str, default: float) -> float:
    if isinstance(given, Mapping):
        return given.get(name, default)
    return given
