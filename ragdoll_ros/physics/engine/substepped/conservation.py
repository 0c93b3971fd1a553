"""Projection of PyBullet's steps onto conservation of energy, momentum and angular momentum.

Discrete steps violate all three. The projection compares each doll with its energy account and with
the impulses of the loads, and corrects velocities, and in the air also positions, by the smallest
change that restores them.
"""
import math

import numpy as np

from ....model.coordinates import DofLayout, GeneralizedState
from ....model.scene import Scene
from ....model.state import State
from ...rigid_body import cross
from ..doll_totals import DollSums, DollTotals
from ..protocol import Wrenches
from .energy_account import EnergyAccount, mean_wrench

TOLERANCE = 5e-4
"""Relative energy excess that is not corrected: half of the documented bound of 0.1 %."""


class ConservationProjection:
    """Corrects energy and momentum of all dolls of a scene."""

    def __init__(self, scene: Scene, layout: DofLayout) -> None:
        self._sums = DollSums(scene)
        self._layout = layout
        # Energy scale of a doll: a fall by a third of its extent.
        heights = [placement.doll.extent / 3 for placement in scene.dolls]
        self._fall = self._sums.doll_masses * np.linalg.norm(scene.gravity) * heights
        self._own_groups = np.arange(len(scene.dolls))

    def with_momentum(self, coordinates: GeneralizedState, states: tuple[State, State],
                      duration: float, wrenches: Wrenches, touched: np.ndarray) -> GeneralizedState:
        """Restore momenta and centre of mass of dolls without contacts; ``touched`` (d,) bool.

        ``states``: before and after ``duration`` s under ``wrenches``. The missing momentum is
        added as a rigid motion of the locked doll with angular velocity Ic^-1 dL, which leaves
        joint rates unchanged. If any load is a force, no angular momentum is corrected, as the
        moments of forces are not known accurately enough.
        """
        first, last = (self._sums.totals(state) for state in states)
        masses = self._sums.doll_masses[:, None]
        momentum = first.momentum + duration * masses * self._sums.gravity
        angular_momentum = first.angular_momentum.copy()
        for wrench in wrenches:
            doll, (force, torque) = self._sums.doll_of[wrench.bone], mean_wrench(wrench, *states)
            momentum[doll] += duration * force
            angular_momentum[doll] += duration * torque
        if any(wrench.force.any() for wrench in wrenches):
            angular_momentum = last.angular_momentum
        centre = first.centre + duration * (first.momentum + momentum) / 2 / masses
        spin = np.linalg.solve(
            last.inertia, (angular_momentum - last.angular_momentum)[:, :, None])[:, :, 0]
        q, v, layout, air = coordinates.q.copy(), coordinates.v.copy(), self._layout, ~touched
        velocity = (momentum - last.momentum) / masses + cross(
            spin, q[layout.root_positions] - last.centre)
        q[layout.root_positions[air]] += (centre - last.centre)[air]
        v[layout.root_velocities[air]] += velocity[air]
        v[layout.root_angular_velocities[air]] += spin[air]
        return GeneralizedState(q, v)

    def groups(self, pairs: set[tuple[int, int]]) -> np.ndarray:
        """Group index (d,) of each doll: connected components of the touching ``pairs``."""
        groups = self._own_groups.copy()
        for a, b in pairs:
            if min(a, b) >= 0:
                groups[groups == groups[b]] = groups[a]
        return groups

    def surplus(self, account: EnergyAccount, totals: DollTotals, groups: np.ndarray) -> np.ndarray:
        """Energy (d,) J to remove from each doll; zero or negative: none.

        Dolls of one of the ``groups`` (d,) exchange energy by contact: their excess is summed, and
        shared out in proportion to kinetic energy.
        """
        allowed = account.allowed + TOLERANCE * (totals.kinetic + self._fall + account.put_in)
        return _shared(totals.energy - allowed, totals.kinetic, groups)

    def close_step(self, account: EnergyAccount, totals: DollTotals, groups: np.ndarray) -> None:
        """Update the allowed energies: losses of a group are final, exchange within it is kept."""
        excess = _shared(totals.energy - account.allowed, totals.kinetic, groups)
        account.allowed = totals.energy - np.maximum(0.0, excess)

    def without_surplus(self, coordinates: GeneralizedState, totals: DollTotals,
                        surplus: np.ndarray, touched: np.ndarray,
                        account: EnergyAccount) -> GeneralizedState:
        """Remove ``surplus`` (d,) J of kinetic energy and add it to ``account.taken``.

        Momentum and angular momentum are kept: only the velocity relative to the motion of the
        locked doll, with angular velocity Ic^-1 L (Featherstone, Rigid Body Dynamics Algorithms,
        9.6), is scaled. Where its energy is less than the surplus, the rest is taken from all
        motion of a doll that ``touched`` (d,) something, and from the rotation of one in the air,
        where integration error has drawn in the limbs and sped it up.
        """
        v = coordinates.v.copy()
        for doll in np.flatnonzero(surplus > 0):
            velocity = totals.momentum[doll] / self._sums.doll_masses[doll]
            spin = np.linalg.solve(totals.inertia[doll], totals.angular_momentum[doll])
            turning = 0.5 * (totals.angular_momentum[doll] @ spin)
            moving = 0.5 * (totals.momentum[doll] @ velocity)
            inner = max(0.0, totals.kinetic[doll] - moving - turning)
            rest = max(0.0, surplus[doll] - inner)
            held = turning + moving * touched[doll]
            scale = _speed_factor(held, rest)
            self._set_motion(v, doll, coordinates.q, totals.centre[doll], (
                velocity * (scale if touched[doll] else 1.0), scale * spin, velocity, spin),
                _speed_factor(inner, surplus[doll]))
            account.taken += float(min(surplus[doll], inner) + min(rest, held))
        return GeneralizedState(coordinates.q, v)

    def _set_motion(self, v: np.ndarray, doll: int, q: np.ndarray, centre: np.ndarray,
                    rigid: tuple[np.ndarray, ...], scale: float) -> None:
        """Scale a doll's velocity relative to its locked motion, and replace the locked motion.

        ``rigid``: new linear and angular velocity of the locked doll, (3,) each, and the current.
        """
        layout = self._layout
        root, turn = layout.root_velocities[doll], layout.root_angular_velocities[doll]
        arm = q[layout.root_positions[doll]] - centre
        velocity, spin, velocity_now, spin_now = rigid
        v[root] = velocity + cross(spin, arm) + scale * (
            v[root] - velocity_now - cross(spin_now, arm))
        v[turn] = spin + scale * (v[turn] - spin_now)
        v[turn[-1] + 1:layout.doll_v[doll].stop] *= scale


def _speed_factor(energy: float, taken: float) -> float:
    """Speed factor of a motion after ``taken`` J are removed from its ``energy`` J."""
    return math.sqrt(max(0.0, 1 - taken / energy)) if energy > 0 else 0.0


def _shared(values: np.ndarray, kinetic: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """Sums of values (d,) over groups, shared out in proportion to kinetic energy."""
    total = np.bincount(groups, kinetic)[groups]
    share = np.where(total > 0, kinetic, 1) / np.where(
        total > 0, total, np.bincount(groups)[groups])
    return np.bincount(groups, values)[groups] * share
