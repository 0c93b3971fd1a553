"""Hands' springs and drives as loads that are steady for a stretch: for engines without them."""
from __future__ import annotations

import numpy as np

from ....model.state import State
from ...motion import point_motion
from ..protocol import AppliedDrive, AppliedWrench, Drives, Spring, Springs
from .doll_sums import DollSums

LONGEST = 2.5e-3
"""s for which the force of a hand or a drive stays as it is."""


class Pull(AppliedWrench):
    """The load of a hand."""


def pulls(springs: Springs, sums: DollSums, state: State, duration: float) -> list[Pull]:
    """Loads of all hands for the next ``duration`` s."""
    dolls = [sums.doll_of[spring.bone] for spring in springs]
    return [_pull(spring, dolls.count(doll), sums, state, duration)
            for spring, doll in zip(springs, dolls, strict=True)]


def _pull(spring: Spring, sharing: int, sums: DollSums, state: State, h: float) -> Pull:
    """Pull of a spring and damper at the end of the step that it makes (backward Euler).

    f = -k (x + h u' - x_hand) - c (u' - u_hand), u' = u + h (g + W f), W the mobility: all of a
    doll falls with g, whatever its joints. Stable for any h, as the hand never does more than bring
    the point where it shall be. Hands that share a doll see W times their number, as their pulls
    add up.
    """
    place, velocity = point_motion(state, spring.bone, spring.point)
    velocity = velocity + h * sums.gravity
    hand = spring.after(h).position
    force = -(spring.stiffness * (place + h * velocity - hand)
              + spring.damping * (velocity - (hand - spring.position) / h))
    softened = np.eye(3) + h * (spring.damping + h * spring.stiffness) * sharing * mobility(
        sums, state, spring.bone, spring.point)
    force = np.linalg.solve(softened, force)
    return Pull(spring.bone, _limited(force, spring.most), np.zeros(3), spring.point)


def driven(drives: Drives, sums: DollSums, state: State, duration: float) -> list[AppliedWrench]:
    """Loads of all drives for the next ``duration`` s."""
    return [_driven(drive, sums, state, duration) for drive in drives]


def _driven(drive: AppliedDrive, sums: DollSums, state: State, h: float) -> AppliedWrench:
    """Force and torque of a drive at the end of the step that they make, as of a hand's damper."""
    bone = drive.bone
    turn = state.rotation_matrices[bone]
    missing = drive.targets - np.stack([state.linear_velocities[bone] + h * sums.gravity,
                                        state.angular_velocities[bone]])
    force, torque = (
        _limited(gain * np.linalg.solve(np.eye(3) + h * gain * ease, lack), most)
        for gain, ease, lack, most in zip(
            drive.gains, (np.eye(3) / sums.masses[bone], (turn / sums.inertias[bone]) @ turn.T),
            missing, drive.most, strict=True))
    return AppliedWrench(bone, force, torque, np.zeros(3))


def _limited(force: np.ndarray, most: float) -> np.ndarray:
    return force * min(1.0, most / max(np.linalg.norm(force), 1e-300))


def mobility(sums: DollSums, state: State, bone: int, point: np.ndarray) -> np.ndarray:
    """Acceleration (3, 3) 1/kg of a point of a bone per force there, were the bone free.

    W = 1/m + [r]^T I^-1 [r], r the point's arm and [r] a = r x a. In a doll the bone gives way
    less (the inverse of the operational space inertia, Khatib 1987): a hand that counts on more is
    the gentler.
    """
    turn = state.rotation_matrices[bone]
    arm = np.cross(np.eye(3), turn @ point)
    ease = (turn / sums.inertias[bone]) @ turn.T
    return np.eye(3) / sums.masses[bone] + arm @ ease @ arm.T
