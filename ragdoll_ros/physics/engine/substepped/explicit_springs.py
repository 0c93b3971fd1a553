"""Springs of hands and drives as constant loads over an interval, for engines without them."""
import numpy as np

from ....model.state import State
from ...rigid_body import point_motion
from ..doll_totals import DollSums
from ..protocol import AppliedDrive, AppliedWrench, Drives, Spring, Springs

CONSTANT_FORCE_TIME = 2.5e-3
"""s: longest interval over which the force of a hand or a drive is constant."""


class SpringWrench(AppliedWrench):
    """The load of a hand's spring; its work is accounted for separately."""


def spring_wrenches(springs: Springs, sums: DollSums, state: State,
                    duration: float) -> list[SpringWrench]:
    """Loads of all hands over the next ``duration`` s."""
    dolls = [sums.doll_of[spring.bone] for spring in springs]
    return [_spring_wrench(spring, dolls.count(doll), sums, state, duration)
            for spring, doll in zip(springs, dolls, strict=True)]


def _spring_wrench(spring: Spring, sharing: int, sums: DollSums, state: State,
                   h: float) -> SpringWrench:
    """Force of a spring and damper at the end of a step h (backward Euler).

    f = -k (x + h u' - x_hand) - c (u' - u_hand), u' = u + h (g + W f), W the mobility. Stable for
    any h. W is multiplied by ``sharing``, the number of hands on the doll, as their forces add up.
    """
    place, velocity = point_motion(state, spring.bone, spring.point)
    velocity = velocity + h * sums.gravity
    hand = spring.after(h).position
    force = -(spring.stiffness * (place + h * velocity - hand)
              + spring.damping * (velocity - (hand - spring.position) / h))
    softened = np.eye(3) + h * (spring.damping + h * spring.stiffness) * sharing * mobility(
        sums, state, spring.bone, spring.point)
    force = np.linalg.solve(softened, force)
    return SpringWrench(spring.bone, _limited(force, spring.most), np.zeros(3), spring.point)


def drive_wrenches(drives: Drives, sums: DollSums, state: State,
                   duration: float) -> list[AppliedWrench]:
    """Loads of all drives over the next ``duration`` s."""
    return [_drive_wrench(drive, sums, state, duration) for drive in drives]


def _drive_wrench(drive: AppliedDrive, sums: DollSums, state: State, h: float) -> AppliedWrench:
    """Force and torque of a drive at the end of a step h (backward Euler)."""
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
    """Mobility (3, 3) 1/kg of a point of the bone without its joints: acceleration per force.

    W = 1/m + [r]^T I^-1 [r], r the arm from the centre of mass and [r] a = r x a. It is an upper
    bound on the doll's (the inverse operational space inertia, Khatib 1987), so that a spring that
    assumes it is too soft rather than too stiff.
    """
    turn = state.rotation_matrices[bone]
    arm = np.cross(np.eye(3), turn @ point)
    ease = (turn / sums.inertias[bone]) @ turn.T
    return np.eye(3) / sums.masses[bone] + arm @ ease @ arm.T
