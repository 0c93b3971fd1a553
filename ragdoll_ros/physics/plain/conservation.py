"""Conservation: energy never grows by itself, momentum never changes by itself.

A discrete step errs in both. The guard knows what the dolls may have (their energy so far and
the pushes' work; their momentum and the pushes' impulses) and takes what is too much out of the
velocities, by the smallest change of motion that does it.
"""
from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...model import rotation
from ...model.coordinates import DofLayout, GeneralizedState
from ...model.scene import Scene
from ...model.state import State
from ..motion import Motion, Shift, cross
from .mechanics import Mechanics

TOLERANCE = 5e-4
"""Energy above the budget, as a share of the doll's energy, that is left alone: half of the
0.1 % that is promised."""

BURST = 0.02
"""Energy from nothing, as a share of the doll's, at which a step has failed beyond mending:
bones jammed into each other that burst apart. The doll is stopped, which is counted."""

LARGEST_TURN = 0.01
"""rad by which a single body may be turned to keep its angular momentum; no step errs by more."""


@dataclass
class EnergyBudget:
    """What each of d dolls may have."""

    energy: np.ndarray
    """(d,) J: the lowest energy so far, plus work since."""
    put_in: np.ndarray
    """(d,) J: sum of the sizes of all work done by pushes."""
    taken: float = 0.0
    """J: energy that projections have taken out since the start."""
    stops: int = 0
    """Times that a doll was stopped where it stood, as no less would do."""


class ConservationProjection:
    """Keeps the budget of all dolls of a scene."""

    def __init__(self, scene: Scene, mechanics: Mechanics, layout: DofLayout) -> None:
        self._mechanics = mechanics
        self._layout = layout
        self._gravity = np.array(scene.gravity)
        # Falling by a third of its size sets the scale of a doll's energy.
        heights = [placement.doll.extent / 3 for placement in scene.dolls]
        self._fall = mechanics.doll_masses * np.linalg.norm(scene.gravity) * heights
        self._own_groups = np.arange(len(scene.dolls))
        self._single = np.array([len(placement.doll.bones) == 1 for placement in scene.dolls])

    def open(self, state: State) -> None:
        """Start the budget anew from a state."""
        energy = self._mechanics.energy(state)
        self.budget = EnergyBudget(energy, np.zeros_like(energy))
        self.start = energy.copy()
        """(d,) J at the start."""
        self.worked = np.zeros_like(energy)
        """(d,) J: work of pushes since."""

    def add_work(self, work: np.ndarray) -> None:
        """Enter work (d,) J that pushes did."""
        self.budget.energy += work
        self.worked += work
        self.budget.put_in += np.abs(work)

    def surplus(self, motion: Motion, groups: np.ndarray) -> np.ndarray:
        """Energy (d,) J that each doll must lose; zero or below: none.

        Dolls of one group (``groups`` (d,): a number for each doll) may touch and so share their
        energy; what is too much is taken from each in proportion to its kinetic energy.
        """
        budget = self.budget
        allowed = budget.energy + TOLERANCE * (motion.kinetic + self._fall + budget.put_in)
        if groups is self._own_groups:
            return motion.energy - allowed
        kinetic = np.bincount(groups, motion.kinetic)[groups]
        share = motion.kinetic / np.where(kinetic > 0, kinetic, 1)
        return np.bincount(groups, motion.energy - allowed)[groups] * share

    def close_step(self, energy: np.ndarray, groups: np.ndarray) -> None:
        """Close a step: what a group has lost it has lost for good."""
        budget = self.budget
        if groups is not self._own_groups:
            excess = np.maximum(0, np.bincount(groups, energy - budget.energy))
            budget.energy = energy - (excess / np.maximum(1, np.bincount(groups)))[groups]
        np.minimum(budget.energy, energy, out=budget.energy)

    def groups(self, pairs: set[tuple[int, int]]) -> np.ndarray:
        """Number (d,) of the group that each doll is in, the dolls of a pair being in one."""
        pairs = [(a, b) for a, b in pairs if a != b and min(a, b) >= 0]
        if not pairs:
            return self._own_groups
        groups = self._own_groups.copy()
        for a, b in pairs:
            groups[groups == groups[b]] = groups[a]
        return groups

    def touched(self, pairs: set[tuple[int, int]]) -> np.ndarray:
        """Which dolls (d,) are in one of the pairs."""
        found = np.zeros(len(self._own_groups), bool)
        found[[doll for pair in pairs for doll in pair if doll >= 0]] = True
        return found

    def keep_momentum(self, state: State, before: Motion, after: Motion, duration: float,
                      impulse: np.ndarray | float = 0.0, moment: np.ndarray | float | None = 0.0,
                      touched: np.ndarray | None = None
                      ) -> tuple[State, Motion, np.ndarray | None]:
        """State and motion with the momentum that is due, and how roots were turned for it."""
        shift, due = self.momentum_due(before, after, duration, impulse, moment, touched)
        return self._mechanics.shifted(state, after, shift), due, shift.rotation

    def momentum_due(self, before: Motion, after: Motion, duration: float,
                     impulse: np.ndarray | float = 0.0,
                     moment: np.ndarray | float | None = 0.0,
                     touched: np.ndarray | None = None) -> tuple[Shift, Motion]:
        """What dolls in the air lack of their due momentum and displacement, and their motion
        with it. Those that were ``touched`` (d,) stay as they are.

        ``impulse`` (d, 3) N s and ``moment`` (d, 3) N m s are what pushes gave; no moment: the
        angular momentum is left as it is. The lack is made up by a motion of the whole doll as
        one rigid body, with a spin Ic^-1 dL, so that no joint notices. It adds P v + M v v / 2 to
        the kinetic energy, and L w + w I w / 2 about the centre of mass. What is a single body is
        first turned, see _aligning.
        """
        masses = self._mechanics.doll_masses[:, None]
        momentum = before.momentum + impulse + masses * (self._gravity * duration)
        centre = before.centre + (before.momentum + momentum) * (duration / 2 / masses)
        if touched is not None:
            momentum = np.where(touched[:, None], after.momentum, momentum)
            centre = np.where(touched[:, None], after.centre, centre)
        linear = (momentum - after.momentum) / masses
        gained = (momentum + after.momentum) * linear
        spin, inertia, turn = after.angular_momentum, after.inertia, None
        if moment is None:
            moment, turned = spin, np.zeros_like(linear)
        else:
            moment = before.angular_momentum + moment
            if touched is not None:
                moment = np.where(touched[:, None], spin, moment)
            turn = self._aligning(spin, moment)
            if turn is not None:
                matrices = rotation.matrix(turn)
                spin = np.matmul(matrices, spin[:, :, None])[:, :, 0]
                inertia = np.matmul(np.matmul(matrices, inertia), matrices.transpose(0, 2, 1))
            turned = np.linalg.solve(inertia, (moment - spin)[:, :, None])[:, :, 0]
            gained += (moment + spin) * turned
        kinetic = after.kinetic + gained.sum(axis=1) / 2
        energy = kinetic - self._mechanics.doll_masses * (centre @ self._gravity)
        return (Shift(centre - after.centre, linear, turned, turn),
                Motion(energy, kinetic, centre, momentum, moment, inertia))

    def _aligning(self, spin: np.ndarray, wanted: np.ndarray) -> np.ndarray | None:
        """Turns (d, 4) that take the angular momentum of single bodies to the one wanted.

        By Euler's equations a body's angular velocity along its own axes owes nothing to its
        attitude: an error across the angular momentum is one of the attitude. To mend it in the
        velocity instead would disturb the tumbling, a thousandfold in five seconds.
        """
        if not self._single.any():
            return None
        sizes = np.sqrt((spin ** 2).sum(axis=1) * (wanted ** 2).sum(axis=1))
        sines = cross(spin, wanted) / np.where(sizes > 0, sizes, 1.0)[:, None]
        small = self._single & ((sines ** 2).sum(axis=1) < LARGEST_TURN ** 2)
        return rotation.from_rotation_vector(np.where(small[:, None], sines, 0.0))

    def without_surplus(self, before: GeneralizedState, coordinates: GeneralizedState,
                        motion: Motion,
                        surplus: np.ndarray, touched: bool) -> GeneralizedState:
        """Take ``surplus`` (d,) J out of the dolls' motion.

        Each doll keeps its momentum and angular momentum: of its motion only what it does
        beside moving as one rigid body, with the angular velocity Ic^-1 L of the doll locked in
        its pose (Featherstone, Rigid Body Dynamics Algorithms, 9.6), is scaled down. Where that
        holds less than the surplus and something outside may have ``touched`` the doll, all its
        motion is; and where that is not enough either, contacts have pushed the doll uphill, and
        it stands where it was ``before``. In the air a step has then drawn limbs in for nothing,
        which turns the doll faster: its rotation gives the rest (in 1 of 10 000 starts).
        """
        layout, q, v = self._layout, coordinates.q.copy(), coordinates.v.copy()
        for doll in np.flatnonzero(surplus > 0):
            centre = motion.centre[doll]
            linear = motion.momentum[doll] / self._mechanics.doll_masses[doll]
            spin = np.linalg.solve(motion.inertia[doll], motion.angular_momentum[doll])
            rigid = 0.5 * (motion.momentum[doll] @ linear + motion.angular_momentum[doll] @ spin)
            inner = max(0.0, motion.kinetic[doll] - rigid)
            scale = math.sqrt(max(0.0, 1 - surplus[doll] / inner)) if inner > 0 else 0.0
            rest, turning = surplus[doll] - inner, 0.5 * (motion.angular_momentum[doll] @ spin)
            if rest > 0 and not touched and turning > 0:
                spin = spin * math.sqrt(max(0.0, 1 - rest / turning))
                self.budget.taken += min(rest, turning)
            self._scale(v, doll, coordinates.q, centre, linear, spin, scale)
            self.budget.taken += min(surplus[doll], inner)
            if rest > 0 and touched:
                v[layout.own_v[doll]] *= math.sqrt(max(0.0, 1 - rest / rigid)) if rigid > 0 else 0
                self.budget.taken += min(rest, rigid)
                if rest > rigid:
                    q[layout.own_q[doll]] = before.q[layout.own_q[doll]]
        return GeneralizedState(q, v)

    def burst(self, motion: Motion, groups: np.ndarray) -> np.ndarray:
        """Which dolls (d,) have far more than they may even after a correction."""
        scale = motion.kinetic + self._fall + self.budget.put_in
        return self.surplus(motion, groups) > BURST * scale

    def stopped(self, start: GeneralizedState, end: GeneralizedState,
                burst: np.ndarray) -> GeneralizedState:
        """``end`` with the dolls that have ``burst`` (d,) at rest where they were."""
        q, v = end.q.copy(), end.v.copy()
        for doll in np.flatnonzero(burst):
            q[self._layout.own_q[doll]] = start.q[self._layout.own_q[doll]]
            v[self._layout.own_v[doll]] = 0.0
            self.budget.stops += 1
        return GeneralizedState(q, v)

    def _scale(self, v: np.ndarray, doll: int, q: np.ndarray, centre: np.ndarray,
               linear: np.ndarray, spin: np.ndarray, scale: float) -> None:
        """Scale a doll's motion about that of the locked doll."""
        layout = self._layout
        root, turn = layout.root_velocities[doll], layout.root_spins[doll]
        locked = linear + cross(spin, q[layout.root_positions[doll]] - centre)
        v[root] = locked + scale * (v[root] - locked)
        v[turn] = spin + scale * (v[turn] - spin)
        v[turn[-1] + 1:layout.own_v[doll].stop] *= scale
