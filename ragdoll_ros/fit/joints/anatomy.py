"""A person's shoulders and hips: ranges from the anatomical pose, whatever the bind pose is.

In the anatomical pose a person stands upright, arms and legs down. The ranges are the averages of
the American Academy of Orthopaedic Surgeons (Joint Motion: Method of Measuring and Recording,
1965). Each joint has three angles. The first is about an axis fixed in the trunk: abduction of an
arm, about forward, and flexion of a leg, about left. The second takes the limb out of that plane,
the third turns it about itself. So an arm bound straight out and one bound half down differ in the
zero of the first angle, and in nothing else.
"""
from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...model.ragdoll import LARGEST_SWING, Joint

FORWARD, LEFT, UP = np.eye(3)

STEEPEST = math.radians(60)
"""A limb bound further out of the plane of its first angle has no such angle."""

KNEE, ELBOW = math.radians(135), math.radians(150)
"""Flexion from straight, same source."""


@dataclass(frozen=True)
class Range:
    """Degrees from the anatomical pose, of the left side; about ``axis``, toward it, and twist."""

    axis: np.ndarray
    first: tuple[float, float]
    second: tuple[float, float]
    twist: tuple[float, float]


RANGES = {
    # Adduction 30 (with the trunk in the way) to abduction 180; extension 60, and flexion up to
    # where three angles lose a freedom: higher goes by abduction; rotation 90 out, 70 in.
    'upper_arm': Range(FORWARD, (-30, 180), (-60, 85), (-90, 70)),
    # Flexion 120 to extension 30; adduction 30 to abduction 45; rotation 45 both ways.
    'thigh': Range(LEFT, (-120, 30), (-30, 45), (-45, 45))}


def persons_joint(parent: str, child: str, role: str, side: int, anchor: np.ndarray,
                  along: np.ndarray) -> Joint | None:
    """Ball joint of a shoulder (role upper_arm) or a hip (thigh) of a limb bound ``along`` (3,).

    ``side`` is 1 left, -1 right. None where the limb is bound too steeply out of the plane of the
    first angle.
    """
    found = RANGES[role]
    axis = found.axis
    out = math.asin(max(-1.0, min(1.0, float(along @ axis))))
    if abs(out) > STEEPEST:
        return None
    inside = along - (along @ axis) * axis
    inside = inside / np.linalg.norm(inside)
    # About the axis from down, right-handed.
    bound = math.atan2(float(np.cross(-UP, inside) @ axis), float(-UP @ inside))
    # A mirrored turn is one the other way, but for those whose axis is the mirror's own normal.
    first, second = (_mirrored(pair) if side < 0 and flips else pair for pair, flips in (
        (found.first, axis is FORWARD), (found.second, axis is LEFT)))
    twist = _mirrored(found.twist) if side < 0 else found.twist
    limits = (_from(first, bound), _from(second, out), _from(twist, 0.0))
    second = tuple(max(-LARGEST_SWING, min(LARGEST_SWING, angle)) for angle in limits[1])
    return Joint(parent, child, 'ball', anchor, (inside, axis), (limits[0], second, limits[2]))


def _mirrored(pair: tuple[float, float]) -> tuple[float, float]:
    return -pair[1], -pair[0]


def _from(pair: tuple[float, float], zero: float) -> tuple[float, float]:
    """Degrees to rad, counted from ``zero`` rad."""
    low, high = (math.radians(angle) - zero for angle in pair)
    # An arm bound higher than any arm goes may stay there.
    return min(low, 0.0), max(high, 0.0)
