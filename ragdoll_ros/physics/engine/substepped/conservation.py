"""Conservation for PyBullet: energy never grows by itself, momentum never changes by itself.

A discrete step errs in both. The projection knows what the dolls may have (their energy so far and
the pushes' work; their momentum and the pushes' impulses) and takes what is too much out of the
velocities, by the smallest change of motion that does it.
"""
from __future__ import annotations

import math

import numpy as np

from ....model.coordinates import DofLayout, GeneralizedState
from ....model.scene import Scene
from ....model.state import State
from ...motion import Motion, cross
from ..protocol import Wrenches
from .doll_sums import DollSums
from .energy_account import Account
from .work import mean_load

TOLERANCE = 5e-4
"""Energy above what is allowed, as a share of the doll's energy, that is left alone: half of the
0.1 % that is promised."""


class ConservationProjection:
    """Keeps the account of all dolls of a scene."""

    def __init__(self, scene: Scene, layout: DofLayout) -> None:
        self._sums = DollSums(scene)
        self._layout = layout
        # Falling by a third of its size sets the scale of a doll's energy.
        heights = [placement.doll.extent / 3 for placement in scene.dolls]
        self._fall = self._sums.doll_masses * np.linalg.norm(scene.gravity) * heights
        self._own_groups = np.arange(len(scene.dolls))

    def with_momentum(self, coordinates: GeneralizedState, states: tuple[State, State],
                      duration: float, wrenches: Wrenches,
                      touched: np.ndarray) -> GeneralizedState:
        """The coordinates with the momentum that is due, for dolls that were not ``touched`` (d,).

        ``states``: before and after a stretch of ``duration`` s under ``wrenches``. What is lacking
        is made up by a motion of the whole doll as one rigid body about its centre of mass, with a
        spin Ic^-1 dL, so that no joint notices. The moment of a force, whose point has moved, is
        not known well enough: then the angular momentum is left as it is.
        """
        first, last = (self._sums.motion(state) for state in states)
        masses = self._sums.doll_masses[:, None]
        momentum = first.momentum + duration * masses * self._sums.gravity
        angular_momentum = first.angular_momentum.copy()
        for wrench in wrenches:
            doll, (force, torque) = self._sums.doll_of[wrench.bone], mean_load(wrench, *states)
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
        """Number (d,) of the group that each doll is in, the dolls of a pair being in one."""
        groups = self._own_groups.copy()
        for a, b in pairs:
            if min(a, b) >= 0:
                groups[groups == groups[b]] = groups[a]
        return groups

    def surplus(self, account: Account, motion: Motion, groups: np.ndarray) -> np.ndarray:
        """Energy (d,) J that each doll must lose; zero or below: none.

        Dolls of one group (``groups`` (d,)) may touch and so share their energy; what is too much
        is taken from each in proportion to its kinetic energy.
        """
        allowed = account.allowed + TOLERANCE * (motion.kinetic + self._fall + account.put_in)
        return _shared(motion.energy - allowed, motion.kinetic, groups)

    def close_step(self, account: Account, motion: Motion, groups: np.ndarray) -> None:
        """Close a step: what a group has lost it has lost for good, and what its dolls have handed
        to each other is theirs.
        """
        excess = _shared(motion.energy - account.allowed, motion.kinetic, groups)
        account.allowed = motion.energy - np.maximum(0.0, excess)

    def without_surplus(self, coordinates: GeneralizedState, motion: Motion, surplus: np.ndarray,
                        touched: np.ndarray, account: Account) -> GeneralizedState:
        """Take ``surplus`` (d,) J out of the dolls' motion, and enter what was taken.

        Each doll keeps its momentum and angular momentum: of its motion only what it does
        beside moving as one rigid body, with the angular velocity Ic^-1 L of the doll locked in
        its pose (Featherstone, Rigid Body Dynamics Algorithms, 9.6), is scaled down. Where that
        holds less than the surplus, what something outside has ``touched`` (d,) gives of all its
        motion. In the air a step has then drawn limbs in for nothing, which turns the doll faster:
        its rotation gives the rest.
        """
        v = coordinates.v.copy()
        for doll in np.flatnonzero(surplus > 0):
            velocity = motion.momentum[doll] / self._sums.doll_masses[doll]
            spin = np.linalg.solve(motion.inertia[doll], motion.angular_momentum[doll])
            turning = 0.5 * (motion.angular_momentum[doll] @ spin)
            moving = 0.5 * (motion.momentum[doll] @ velocity)
            inner = max(0.0, motion.kinetic[doll] - moving - turning)
            rest = max(0.0, surplus[doll] - inner)
            held = turning + moving * touched[doll]
            scale = _left(held, rest)
            self._set_motion(v, doll, coordinates.q, motion.centre[doll], (
                velocity * (scale if touched[doll] else 1.0), scale * spin, velocity, spin),
                _left(inner, surplus[doll]))
            account.taken += float(min(surplus[doll], inner) + min(rest, held))
        return GeneralizedState(coordinates.q, v)

    def _set_motion(self, v: np.ndarray, doll: int, q: np.ndarray, centre: np.ndarray,
                    rigid: tuple[np.ndarray, ...], scale: float) -> None:
        """Scale a doll's motion beside that of the locked doll, and give it another locked motion.

        ``rigid``: the wanted velocity and spin of the locked doll, (3,) each, and those it has.
        """
        layout = self._layout
        root, turn = layout.root_velocities[doll], layout.root_angular_velocities[doll]
        arm = q[layout.root_positions[doll]] - centre
        velocity, spin, velocity_now, spin_now = rigid
        v[root] = velocity + cross(spin, arm) + scale * (
            v[root] - velocity_now - cross(spin_now, arm))
        v[turn] = spin + scale * (v[turn] - spin_now)
        v[turn[-1] + 1:layout.doll_v[doll].stop] *= scale


def _left(energy: float, taken: float) -> float:
    """Share of the speed that is left of a motion from whose energy, J, some is taken."""
    return math.sqrt(max(0.0, 1 - taken / energy)) if energy > 0 else 0.0


def _shared(values: np.ndarray, kinetic: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """Sums (d,) of values over groups, handed to the dolls by their kinetic energies."""
    total = np.bincount(groups, kinetic)[groups]
    share = np.where(total > 0, kinetic, 1) / np.where(
        total > 0, total, np.bincount(groups)[groups])
    return np.bincount(groups, values)[groups] * share
