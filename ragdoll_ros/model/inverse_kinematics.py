"""Inverse kinematics: joint angles and rates at which a doll follows given motions of its bones.

From the root, which follows exactly, to the tips: each joint takes the rotation of its child as far
as its axes and limits allow, relative to where its parent has come. Positions follow from the
anchors; the distances that remain say how well the doll can follow.
"""
from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from . import rotation
from .forward_kinematics import BoneMotion, bone_motions
from .pose import Pose
from .ragdoll import Joint, Limits, Ragdoll, joint_axes

CLIP_TOLERANCE = math.radians(0.01)
"""rad by which an angle may exceed its limits before it counts as clipped."""

LARGEST_SWING = math.radians(89)
"""rad of a ball joint at which rates are computed beyond: at 90 degrees they are infinite, and the
limits of a swing end at 85."""


@dataclass(frozen=True)
class FollowedMotion:
    """Pose and velocity of a doll, as of a Placement, and how well it follows what was asked."""

    pose: Pose
    """Of the doll's frame."""
    velocity: np.ndarray
    """(3,) m/s, of the centre of mass."""
    spin: np.ndarray
    """(3,) rad/s, of the root."""
    angles: dict[str, float]
    """rad, by the names of the doll's angles."""
    rates: dict[str, float]
    """rad/s; zero where the angle is clipped."""
    distances: dict[str, float]
    """m, from the centre of mass of each bone to where it should be."""
    clipped: tuple[str, ...]
    """Names of the angles that would exceed their limits."""


def follow_motions(doll: Ragdoll, motions: Mapping[str, BoneMotion]) -> FollowedMotion:
    """The doll at ``motions`` of its bones, by name, in the frame that the result is in.

    The root needs one; a joint whose child has none stays at zero.
    """
    turns, spins = {doll.root.name: motions[doll.root.name].turn}, {
        doll.root.name: motions[doll.root.name].spin}
    angles: dict[str, float] = {}
    rates: dict[str, float] = {}
    clipped: list[str] = []
    for joint in doll.joints_depth_first():
        turn, spin = turns[joint.parent], spins[joint.parent]
        if joint.child in motions:
            wished = motions[joint.child]
            back = rotation.inverse(turn)
            found = _joint_angles(joint, rotation.multiply(back, wished.turn),
                                  rotation.rotate(back, wished.spin - spin))
            for name, limits, (angle, rate) in zip(joint.angle_names, _limits(joint), found,
                                                   strict=True):
                angles[name], rates[name], is_clipped = _clip(angle, rate, limits)
                clipped += [name] * is_clipped
        for name, axis in zip(joint.angle_names, joint_axes(joint), strict=True):
            spin = spin + rates.get(name, 0.0) * rotation.rotate(turn, axis)
            turn = rotation.multiply(turn, rotation.from_axis_angle(axis, angles.get(name, 0.0)))
        turns[joint.child], spins[joint.child] = turn, spin
    return _followed(doll, motions, angles, rates, tuple(clipped))


def _followed(doll: Ragdoll, motions: Mapping[str, BoneMotion], angles: dict[str, float],
              rates: dict[str, float], clipped: tuple[str, ...]) -> FollowedMotion:
    root = motions[doll.root.name]
    pose = Pose(root.position - rotation.rotate(root.turn, doll.root.position), root.turn)
    within = bone_motions(doll, angles, rates)
    places = {name: pose.apply(motion.position) for name, motion in within.items()}
    speeds = [root.velocity + np.cross(root.spin, places[name] - root.position)
              + rotation.rotate(root.turn, motion.velocity) for name, motion in within.items()]
    velocity = np.average(speeds, axis=0, weights=[doll.bone(name).mass for name in within])
    distances = {name: float(np.linalg.norm(places[name] - motion.position))
                 for name, motion in motions.items()}
    return FollowedMotion(pose, velocity, root.spin, angles, rates, distances, clipped)


def _joint_angles(joint: Joint, turn: np.ndarray, spin: np.ndarray) -> list[tuple[float, float]]:
    """Angle, rad, and rate, rad/s, about each axis, of the child relative to the parent.

    ``turn`` (4,) since the bind pose and ``spin`` (3,) rad/s are in the parent's bind axes. What
    the axes do not allow is left out: of a hinge the swing of the swing-twist decomposition, of a
    universal joint the last of three angles.
    """
    axes = joint_axes(joint)
    if len(axes) == 0:
        return []
    if len(axes) == 1:
        return [_twist(axes[0], turn, spin)]
    if len(axes) == 2:
        axes = np.array([*axes, np.cross(*axes)])
    frame = rotation.from_matrix(axes.T)
    local = rotation.multiply(rotation.inverse(frame), rotation.multiply(turn, frame))
    angles = rotation.to_euler_xyz(local)
    body_spin = rotation.rotate(rotation.inverse(rotation.multiply(turn, frame)), spin)
    near = (angles[0], math.copysign(min(abs(angles[1]), LARGEST_SWING), angles[1]), angles[2])
    rates = rotation.euler_xyz_rates(near, body_spin)
    return list(zip(angles, rates.tolist(), strict=True))[:joint.dof]


def _twist(axis: np.ndarray, turn: np.ndarray, spin: np.ndarray) -> tuple[float, float]:
    """Rotation about ``axis`` nearest to ``turn``, and its rate: 2 atan(turn . axis / w)."""
    along, w = turn[:3] @ axis, turn[3]
    changes = rotation.multiply(np.append(spin, 0.0), turn) / 2
    norm = along * along + w * w
    rate = 2 * (w * (changes[:3] @ axis) - along * changes[3]) / norm if norm > 1e-12 else 0.0
    return math.remainder(2 * math.atan2(along, w), math.tau), float(rate)


def _limits(joint: Joint) -> tuple[Limits | None, ...]:
    return (None,) * joint.dof if joint.is_free_ball else joint.angle_limits


def _clip(angle: float, rate: float, limits: Limits | None) -> tuple[float, float, bool]:
    """Angle within its limits, its rate, and whether it had to be clipped by more than rounding."""
    if limits is None:
        return angle, rate, False
    lower, upper = limits
    angle = min((angle, angle - math.tau, angle + math.tau),
                key=lambda each: max(lower - each, each - upper, 0.0))
    excess = max(lower - angle, angle - upper)
    return min(max(angle, lower), upper), rate if excess <= 0 else 0.0, excess > CLIP_TOLERANCE
