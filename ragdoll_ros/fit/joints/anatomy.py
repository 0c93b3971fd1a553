"""Joints of a person with two or three angles, limited from the anatomical pose.

In the anatomical pose a person stands upright, arms and legs down. The ranges are the averages of
the American Academy of Orthopaedic Surgeons (Joint Motion: Method of Measuring and Recording,
1965). The first angle is about an axis fixed in the parent: abduction of an arm, about forward;
flexion of all others. The second moves the limb out of that plane, the third is the twist. An arm
whose bind pose is straight out therefore differs from one that is half down in the zero of the
first angle only. A wrist has no twist, because the forearm twists; the doll has no joint for that.
An ankle's second angle is about the foot's long axis.
"""
import math
from dataclasses import dataclass

import numpy as np

from ...model import rotation
from ...model.ragdoll import MAX_SWING, Joint, Limits
from .neutral import FOOT_SLOPE, NeutralDirections

MAX_ELEVATION = math.radians(60)
"""Elevation out of the plane of the first angle beyond which that angle is undefined."""

KNEE, ELBOW = math.radians(135), math.radians(150)
"""Flexion from the straight limb, same source."""

Degrees = tuple[float, float]


@dataclass(frozen=True)
class JointRange:
    """Degrees from the anatomical pose, left side; None: no such angle."""

    first: Degrees
    """About the axis of the joint's NeutralDirections."""
    second: Degrees | None
    """Towards that axis."""
    twist: Degrees | None
    mirrored: tuple[bool, bool, bool]
    """Which of the three change sign on the right side."""


RANGES = {
    # Adduction 30 (the trunk blocks more) to abduction 180; extension 60, and flexion up to the
    # gimbal singularity: abduction reaches higher; rotation 90 outward, 70 inward.
    'upper_arm': JointRange((-30, 180), (-60, 85), (-90, 70), (True, False, True)),
    # Flexion 120 to extension 30; adduction 30 to abduction 45; rotation 45 both ways.
    'thigh': JointRange((-120, 30), (-30, 45), (-45, 45), (False, True, True)),
    # Extension 70 to flexion 80; radial deviation 20, ulnar 30.
    'hand': JointRange((-70, 80), (-20, 30), None, (False, True, False)),
    # Dorsiflexion 20 to plantar flexion 50; inversion 35, eversion 15.
    'foot': JointRange((-20, 50), None, (-35, 15), (False, False, True)),
    # Extension 45 to flexion 45; 45 to either side; rotation 60. Total of all neck joints.
    'neck': JointRange((-45, 45), (-45, 45), (-60, 60), (False, False, False))}
RANGES['head'] = RANGES['neck']


def human_joint(parent: str, child: str, role: str, side: int, anchor: np.ndarray,
                rest: NeutralDirections, share: float = 1.0) -> Joint | None:
    """Joint of a limb whose role has ranges: ball or, with two angles, universal.

    ``side`` is 1 left, -1 right; ``share`` is this joint's fraction of the role's ranges. None
    where the limb is bound too steeply out of the plane of the first angle.
    """
    ranges, axis = RANGES[role], rest.axis
    elevation = math.asin(max(-1.0, min(1.0, float(rest.along @ axis))))
    if abs(elevation) > MAX_ELEVATION:
        return None
    in_plane = rest.along - (rest.along @ axis) * axis
    in_plane = in_plane / np.linalg.norm(in_plane)
    # About the axis from straight, right-handed.
    bind_angle = math.atan2(float(np.cross(rest.straight, in_plane) @ axis),
                            float(rest.straight @ in_plane))
    first, second, twist = (
        pair and _limits(pair, zero, share, side < 0 and flips) for pair, zero, flips in zip(
            (ranges.first, ranges.second, ranges.twist), (bind_angle, elevation, 0.0),
            ranges.mirrored, strict=True))
    if second is None:
        foot_axis = rotation.rotate(rotation.from_axis_angle(axis, -FOOT_SLOPE), in_plane)
        return Joint(parent, child, 'universal', anchor, (axis, foot_axis), (first, twist))
    if twist is None:
        return Joint(parent, child, 'universal', anchor, (axis, np.cross(in_plane, axis)),
                     (first, second))
    second = tuple(max(-MAX_SWING, min(MAX_SWING, angle)) for angle in second)
    return Joint(parent, child, 'ball', anchor, (in_plane, axis), (first, second, twist))


def _limits(pair: Degrees, zero: float, share: float, mirrored: bool) -> Limits:
    """Limits, rad from ``zero`` rad, of a range in degrees from the anatomical pose."""
    if mirrored:
        pair = -pair[1], -pair[0]
    low, high = (share * math.radians(angle) - zero for angle in pair)
    # The bind pose is always within the limits.
    return min(low, 0.0), max(high, 0.0)
