"""A person's joints of two and three angles: ranges from the anatomical pose, not the bind pose.

In the anatomical pose a person stands upright, arms and legs down. The ranges are the averages of
the American Academy of Orthopaedic Surgeons (Joint Motion: Method of Measuring and Recording,
1965). The first angle is about an axis fixed in the parent: abduction of an arm, about forward;
flexion of all else. The second takes the limb out of that plane, the third turns it about itself.
So an arm bound straight out and one bound half down differ in the zero of the first angle, and in
nothing else. Wrists turn about themselves with the forearm alone, which here has no such joint; an
ankle's second angle is about the foot's own length.
"""
from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...model import rotation
from ...model.ragdoll import MAX_SWING, Joint, Limits
from .neutral import SLOPE, Neutral

STEEPEST = math.radians(60)
"""A limb bound further out of the plane of its first angle has no such angle."""

KNEE, ELBOW = math.radians(135), math.radians(150)
"""Flexion from straight, same source."""

Degrees = tuple[float, float]


@dataclass(frozen=True)
class Range:
    """Degrees from the anatomical pose, of the left side; None: no such angle."""

    first: Degrees
    """About the axis of the joint's Neutral."""
    second: Degrees | None
    """Toward that axis."""
    twist: Degrees | None
    mirrored: tuple[bool, bool, bool]
    """Which of the three are the other way round on the right."""


RANGES = {
    # Adduction 30 (with the trunk in the way) to abduction 180; extension 60, and flexion up to
    # where three angles lose a freedom: higher goes by abduction; rotation 90 out, 70 in.
    'upper_arm': Range((-30, 180), (-60, 85), (-90, 70), (True, False, True)),
    # Flexion 120 to extension 30; adduction 30 to abduction 45; rotation 45 both ways.
    'thigh': Range((-120, 30), (-30, 45), (-45, 45), (False, True, True)),
    # Extension 70 to flexion 80; radial deviation 20, ulnar 30.
    'hand': Range((-70, 80), (-20, 30), None, (False, True, False)),
    # Dorsiflexion 20 to plantar flexion 50; inversion 35, eversion 15.
    'foot': Range((-20, 50), None, (-35, 15), (False, False, True)),
    # Extension 45 to flexion 45; 45 to either side; rotation 60. Of all joints up to the head.
    'neck': Range((-45, 45), (-45, 45), (-60, 60), (False, False, False))}
RANGES['head'] = RANGES['neck']


def persons_joint(parent: str, child: str, role: str, side: int, anchor: np.ndarray,
                  rest: Neutral, share: float = 1.0) -> Joint | None:
    """Joint of a limb whose role has ranges; ball or, without a second or a twist, universal.

    ``side`` is 1 left, -1 right; ``share`` of the ranges is this joint's. None where the limb is
    bound too steeply out of the plane of the first angle.
    """
    found, axis = RANGES[role], rest.axis
    out = math.asin(max(-1.0, min(1.0, float(rest.along @ axis))))
    if abs(out) > STEEPEST:
        return None
    inside = rest.along - (rest.along @ axis) * axis
    inside = inside / np.linalg.norm(inside)
    # About the axis from straight, right-handed.
    bound = math.atan2(float(np.cross(rest.straight, inside) @ axis), float(rest.straight @ inside))
    first, second, twist = (
        pair and _from(pair, zero, share, side < 0 and flips) for pair, zero, flips in zip(
            (found.first, found.second, found.twist), (bound, out, 0.0), found.mirrored,
            strict=True))
    if second is None:
        length = rotation.rotate(rotation.from_axis_angle(axis, -SLOPE), inside)
        return Joint(parent, child, 'universal', anchor, (axis, length), (first, twist))
    if twist is None:
        return Joint(parent, child, 'universal', anchor, (axis, np.cross(inside, axis)),
                     (first, second))
    second = tuple(max(-MAX_SWING, min(MAX_SWING, angle)) for angle in second)
    return Joint(parent, child, 'ball', anchor, (inside, axis), (first, second, twist))


def _from(pair: Degrees, zero: float, share: float, mirrored: bool) -> Limits:
    """Degrees to rad, counted from ``zero`` rad."""
    if mirrored:
        pair = -pair[1], -pair[0]
    low, high = (share * math.radians(angle) - zero for angle in pair)
    # An arm bound higher than any arm goes may stay there.
    return min(low, 0.0), max(high, 0.0)
