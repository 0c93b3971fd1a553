"""Inverse kinematics: joint angles and rates at which a doll follows given motions of its bones.

The joints are solved from the root, which follows exactly, to the tips: each takes the rotation of
its child, relative to the orientation that its parent has reached, as far as its axes and limits
allow. Positions follow from the anchors; the remaining distances tell how well the doll can follow.
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
    """Pose and velocity of a doll, as in a Placement, and how closely it follows given motions."""

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
    """Pose, velocity and joint angles with which the doll follows ``motions`` of its bones, by
    name. The result is in the frame of the motions.

    The root must have a motion; a joint whose child has none stays at zero.
    """
    found = follow_turns(doll, motions)
    angles, rates = ({name: float(each[key]) for name, each in found.items()} for key in (0, 1))
    clipped = tuple(name for name, (_, _, is_clipped) in found.items() if is_clipped)
    return _followed(doll, motions, angles, rates, clipped)


def follow_turns(doll: Ragdoll, motions: Mapping[str, BoneMotion]
                 ) -> dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Joint angles, rad, and rates, rad/s, at which a doll follows the rotations of its bones, and
    whether each angle is clipped: arrays (...), by the angle's name. Motions may be stacked, with
    turns (..., 4) and spins (..., 3). Joints whose child has no motion are left out.
    """
    root = motions[doll.root.name]
    turns, spins, found = {doll.root.name: root.turn}, {doll.root.name: root.spin}, {}
    for joint in doll.joints_depth_first():
        turn, spin = turns[joint.parent], spins[joint.parent]
        if joint.child in motions:
            wished = motions[joint.child]
            back = rotation.inverse(turn)
            each = _joint_angles(joint, rotation.multiply(back, wished.turn),
                                 rotation.rotate(back, wished.spin - spin))
            for name, limits, (angle, rate) in zip(joint.angle_names, _limits(joint), each,
                                                   strict=True):
                found[name] = _clip(angle, rate, limits)
        for name, axis in zip(joint.angle_names, joint_axes(joint), strict=True):
            angle, rate, _ = found.get(name, (np.zeros(turn.shape[:-1]),) * 3)
            spin = spin + rate[..., None] * rotation.rotate(turn, axis)
            turn = rotation.multiply(turn, rotation.from_rotation_vector(angle[..., None] * axis))
        turns[joint.child], spins[joint.child] = turn, spin
    return found


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


def _joint_angles(joint: Joint, turn: np.ndarray,
                  spin: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Angle (...), rad, and rate, rad/s, about each axis, of the child relative to the parent.

    ``turn`` (..., 4) since the bind pose and ``spin`` (..., 3) rad/s are in the parent's bind axes.
    What the axes do not allow is left out: of a hinge the swing of the swing-twist decomposition,
    of a universal joint the last of three angles.
    """
    axes = joint_axes(joint)
    if len(axes) == 0:
        return []
    if len(axes) == 1:
        return [_twist(axes[0], turn, spin)]
    if len(axes) == 2:
        axes = np.array([*axes, np.cross(*axes)])
    frame = rotation.from_matrix(axes.T)
    r = rotation.matrix(rotation.multiply(rotation.inverse(frame), rotation.multiply(turn, frame)))
    first, third = np.arctan2(-r[..., 1, 2], r[..., 2, 2]), np.arctan2(-r[..., 0, 1], r[..., 0, 0])
    second = np.arcsin(r[..., 0, 2].clip(-1.0, 1.0))
    body_spin = rotation.rotate(rotation.inverse(rotation.multiply(turn, frame)), spin)
    # Rates of rotation.euler_xyz_rates(), stacked.
    near, (x, y, z) = second.clip(-LARGEST_SWING, LARGEST_SWING), np.moveaxis(body_spin, -1, 0)
    first_rate = (x * np.cos(third) - y * np.sin(third)) / np.cos(near)
    rates = (first_rate, x * np.sin(third) + y * np.cos(third), z - first_rate * np.sin(near))
    return list(zip((first, second, third), rates, strict=True))[:joint.dof]


def _twist(axis: np.ndarray, turn: np.ndarray,
           spin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angle, rad, of the rotation about ``axis`` nearest to ``turn``, 2 atan(turn . axis / w), and
    its rate, rad/s.
    """
    along, w = turn[..., :3] @ axis, turn[..., 3]
    spins = np.concatenate([spin, np.zeros((*spin.shape[:-1], 1))], axis=-1)
    changes = rotation.multiply(spins, turn) / 2
    norm = along * along + w * w
    rate = 2 * (w * (changes[..., :3] @ axis) - along * changes[..., 3]) / np.maximum(norm, 1e-300)
    angle = 2 * np.arctan2(along, w)
    return (angle - math.tau * np.round(angle / math.tau), np.where(norm > 1e-12, rate, 0.0))


def _limits(joint: Joint) -> tuple[Limits | None, ...]:
    return (None,) * joint.dof if joint.is_free_ball else joint.angle_limits


def _clip(angle: np.ndarray, rate: np.ndarray,
          limits: Limits | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angles within their limits, with the multiple of 2 pi that is nearest to them; their rates,
    zero beyond a limit; and whether they were beyond it by more than CLIP_TOLERANCE.
    """
    if limits is None:
        return angle, rate, np.zeros(angle.shape, bool)
    lower, upper = limits
    turned = angle + math.tau * np.array((0.0, -1.0, 1.0)).reshape(-1, *[1] * angle.ndim)
    nearest = np.argmin(np.maximum(np.maximum(lower - turned, turned - upper), 0.0), axis=0)
    angle = np.take_along_axis(turned, nearest[None], axis=0)[0]
    excess = np.maximum(lower - angle, angle - upper)
    return angle.clip(lower, upper), np.where(excess <= 0, rate, 0.0), excess > CLIP_TOLERANCE
