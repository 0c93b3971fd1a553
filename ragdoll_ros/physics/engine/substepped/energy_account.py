"""Energy of dolls: work of loads over an interval, and EnergyAccount, which sums it up."""
from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from ....model import rotation
from ....model.state import State
from ...rigid_body import cross, point_motion
from ..protocol import AppliedWrench

STEADY = 0.2
"""rad: rotation of a bone over which a torque or a local force counts as constant."""


def steady_time(load: AppliedWrench, state: State, inertia: np.ndarray) -> float:
    """Shortest time, s, in which a bone under a torque or a local load can turn by STEADY.

    Solves w t + a t^2 / 2 = STEADY, a the angular acceleration of the bone without its joints and
    with the smallest of its principal moments ``inertia`` (3,) kg m^2. Infinite for other loads.
    """
    if not (load.local or load.torque.any()):
        return math.inf
    spin = math.hypot(*state.angular_velocities[load.bone])
    force, arm, torque = (math.hypot(*vector) for vector in (load.force, load.point, load.torque))
    gain = (torque + force * arm) / inertia.min()
    root = math.sqrt(spin * spin + 2 * gain * STEADY)
    return 2 * STEADY / (spin + root) if root > 0 else math.inf


def mean_wrench(load: AppliedWrench, before: State, after: State) -> tuple[np.ndarray, np.ndarray]:
    """Mean force (3,) N and torque (3,) N m, world frame; a local load turns at a constant rate."""
    if not load.local:
        return load.force, load.torque
    turn = rotation.mean_rotation_matrix(
        _turned(load.bone, before, after)) @ before.rotation_matrices[load.bone]
    return turn @ load.force, turn @ load.torque


def work(load: AppliedWrench, before: State, after: State, duration: float,
         substep: float) -> float:
    """Work, J, over ``duration`` s: force times displacement of its point plus torque times turn.

    A substep h of semi-implicit Euler moves a point by h v', while the energy grows by
    F (v + v') h / 2; the sum of the differences, F (v_end - v_start) h / 2, is subtracted
    (``substep`` = 0: none). A local load adds the covariance of force and velocity, t dF dv / 12,
    both taken as linear in time. The integral of w is the rotation vector plus
    t^2 / 12 w_start x w_end (Magnus expansion).
    """
    bone = load.bone
    force, torque = mean_wrench(load, before, after)
    (place, speed), (end, end_speed) = (
        point_motion(state, bone, load.point) for state in (before, after))
    faster = end_speed - speed
    spun = after.angular_velocities[bone] - before.angular_velocities[bone]
    done = force @ (end - place - substep / 2 * faster)
    if torque.any():
        swept = _turned(bone, before, after) + duration ** 2 / 12 * cross(
            before.angular_velocities[bone], after.angular_velocities[bone])
        done += torque @ (swept - substep / 2 * spun)
    if load.local:
        change = after.rotation_matrices[bone] - before.rotation_matrices[bone]
        done += duration / 12 * (change @ load.force @ faster + change @ load.torque @ spun)
    return float(done)


def _turned(bone: int, before: State, after: State) -> np.ndarray:
    """Rotation vector (3,) rad of a bone from one state to another, world frame."""
    return rotation.rotation_vector(rotation.multiply(
        after.orientations[bone], rotation.inverse(before.orientations[bone])))


@dataclass
class EnergyAccount:
    """Energy balance of d dolls since the start, J."""

    start: np.ndarray
    """(d,) initial energy."""
    allowed: np.ndarray
    """(d,) lowest energy so far plus the work since."""
    put_in: np.ndarray
    """(d,) sum of the absolute values of all work."""
    pushes: float = 0.0
    """Work of pushes."""
    grabs: float = 0.0
    """Work of hands."""
    taken: float = 0.0
    """Spurious energy that the projection removed."""

    @classmethod
    def opened(cls, energy: np.ndarray) -> EnergyAccount:
        """Open the account of dolls with an initial ``energy`` (d,) J."""
        return cls(energy.copy(), energy.copy(), np.zeros_like(energy))

    def add_work(self, doll: int, work: float, by_hand: bool) -> None:
        """Add the work, J, of a push or of a hand."""
        self.allowed[doll] += work
        self.put_in[doll] += abs(work)
        if by_hand:
            self.grabs += work
        else:
            self.pushes += work

    def lower(self, energy: np.ndarray) -> None:
        """Lower the allowed energy to ``energy`` (d,) J where that is less."""
        np.minimum(self.allowed, energy, out=self.allowed)

    def copy(self) -> EnergyAccount:
        """Copy the account and its arrays."""
        return dataclasses.replace(self, start=self.start.copy(), allowed=self.allowed.copy(),
                                   put_in=self.put_in.copy())

    def excess(self, energy: np.ndarray) -> float:
        """Energy, J, above the initial energy plus all work, for a current ``energy`` (d,) J."""
        return float((energy - self.start).sum()) - self.pushes - self.grabs

    def measures(self, energy: np.ndarray) -> dict[str, float]:
        """Measures for a current ``energy`` (d,) J; keys end in units."""
        return {'energy_excess_J': self.excess(energy), 'energy_projected_J': self.taken,
                'work_of_pushes_J': self.pushes, 'work_of_grabs_J': self.grabs}
