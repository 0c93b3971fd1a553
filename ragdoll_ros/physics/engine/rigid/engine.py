"""The package's own engine: rigid bodies, machine code from a stretch's start to its end.

What it does is in kernels/: advance.py reads as the algorithm. Here are only its tables, its state
and what is told of it.
"""
from __future__ import annotations

import dataclasses

import numpy as np

from ....model import rotation
from ....model.coordinates import DofLayout, GeneralizedState
from ....model.scene import Scene
from ....model.state import State
from ...accuracy import Accuracy
from ...ground_heights import GroundHeights
from ...kernels.system import OUTSIDE, WITHIN
from ...motion import Motion
from ..protocol import GROUND, Contacts, Drives, Springs, Wrenches, pressed
from .broad_phase import Neighbours
from .clusters import Cluster, Clusters
from .loads import NO_LOADS, NO_SPRINGS, load_rows, spring_rows

FINER = 0.25
"""Share of the step by which the last stretch is gone again to tell its error."""

AHEAD = 0.05
"""s that clusters are made for: those that may touch so soon go on together."""

KEPT = 10
"""Stretches for which clusters are kept, unless others come near."""


class RigidEngine:
    """An Engine by the rigid core; see Engine."""

    energy_error = 1e-2
    holds = True

    def __init__(self, scene: Scene, accuracy: Accuracy, *, workers: int = 1) -> None:
        self.scene, self.accuracy = scene, accuracy
        self.layout = DofLayout([placement.doll for placement in scene.dolls])
        self._clusters = Clusters(scene, self.layout, workers)
        self._neighbours = Neighbours(scene, self._clusters.reach())
        self._heights = GroundHeights(scene)
        self._spins = self.layout.root_angular_velocities
        self.resting = np.zeros(len(scene.dolls), bool)
        self._designed = [np.full(len(own), WITHIN) for own in self._clusters.flags(WITHIN)]
        """Pairs that are within each other as bound: they are left so until they come apart."""
        self.place(self._placed())
        self._designed = self._clusters.flags(WITHIN)

    @property
    def state(self) -> State:
        """Poses and velocities of all bones now."""
        return self._state

    @property
    def coordinates(self) -> GeneralizedState:
        """Generalised coordinates and velocities of all dolls now."""
        q, v = self._clusters.q.copy(), self._clusters.v.copy()
        v[self._spins] = rotation.rotate(q[self.layout.root_orientations], v[self._spins])
        return GeneralizedState(q, v)

    @property
    def joint_angles(self) -> np.ndarray:
        """Joint angles (k,) rad now."""
        return self.layout.joint_angles(self._clusters.q)

    @property
    def joint_rates(self) -> np.ndarray:
        """What they change by (k,), rad/s."""
        # The roots' spins, which v has along the roots' own axes, are none of the joints'.
        return self.layout.joint_rates(GeneralizedState(self._clusters.q, self._clusters.v))

    @property
    def motion(self) -> Motion:
        """Sums over each doll now."""
        return self._motion

    @property
    def groups(self) -> np.ndarray:
        """Number (d,) of what each doll goes on with: dolls of one number fall asleep together."""
        return self._clusters.of_doll

    def place(self, coordinates: GeneralizedState) -> None:
        """Put all dolls there and begin; see Engine."""
        clusters, q, v = self._clusters, self._clusters.q, self._clusters.v
        q[:], v[:] = coordinates.q, coordinates.v
        turns = rotation.inverse(q[self.layout.root_orientations])
        v[self._spins] = rotation.rotate(turns, v[self._spins])
        clusters.tally[:] = 0
        clusters.begin()
        self.resting[:] = False
        self._look()
        self._lift_out()
        clusters.within([own | OUTSIDE for own in self._designed])
        self._look()
        self._age = KEPT
        self._start_energy = float(self.motion.energy.sum())
        self._departure = None

    def advance(self, duration: float, wrenches: Wrenches = (), springs: Springs = (),
                drives: Drives = ()) -> None:
        """Go on by ``duration`` s; see Engine."""
        clusters, acting = self._clusters, (wrenches, springs, drives)
        self._departure = clusters.q.copy(), clusters.v.copy(), duration, acting
        for acts in (*wrenches, *springs, *drives):
            self.resting[self.groups == self.groups[self.scene.doll_of_bone[acts.bone]]] = False
        self._meet(duration)
        self._go(duration, acting, self.accuracy)

    def stop(self, dolls: np.ndarray) -> None:
        """Bring dolls (d,) to rest where they are; the energy that is left is lost for good."""
        self._clusters.stop(dolls)
        self.resting[dolls] = True
        self._departure = None
        self._look()

    def grounded(self) -> np.ndarray:
        """Which dolls (d,) rest on the ground."""
        known, bones, _ = self._clusters.touching()
        found = np.zeros(len(self.scene.dolls), bool)
        on = (bones[:, 1] == GROUND) & (known['impulse'][:, 0] > 0)
        found[self.scene.doll_of_bone[bones[on, 0]]] = True
        return found

    def contacts(self) -> Contacts:
        """What touches now."""
        known, bones, lasted = self._clusters.touching()
        return Contacts(bones[:, 0], bones[:, 1], known['point'], known['normal'], -known['gap'],
                        known['impulse'][:, 0] / lasted)

    def bones_on_ground(self) -> np.ndarray:
        """Which bones (n,) touch the ground now."""
        return self._clusters.on_ground()

    @property
    def energy_excess(self) -> float:
        """Energy, J, above that at the start and all work since."""
        return (float(self._motion.energy.sum()) - self._start_energy
                - self._clusters.work())

    def measures(self) -> dict[str, float]:
        """What went wrong since the start, and what was done: names end in their units."""
        tally = self._clusters.totals()
        return {
            'energy_excess_J': self.energy_excess, 'energy_lifted_J': float(tally['lifted']),
            'work_of_pushes_J': float(tally['pushed']), 'work_of_grabs_J': float(tally['handed']),
            'error_estimate_m': self._estimate_error(), 'error_trusted': True,
            'flights': int(tally['flights']), 'substeps': int(tally['steps']),
            'impacts': int(tally['impacts']), 'unsolved_total': int(tally['unsolved'])}

    def save(self) -> object:
        """A snapshot that restore brings back to the bit."""
        return self._clusters.save(), self.resting.copy(), self._age, self._start_energy

    def restore(self, snapshot: tuple) -> None:
        """Go back to a snapshot."""
        kept, self.resting[:], self._age, self._start_energy = snapshot
        self._clusters.restore(kept)
        self._departure = None
        self._show()

    def forget(self, snapshot: object) -> None:
        """Nothing to release: the memory goes with the object."""

    def checkpoint(self) -> object:
        """Where all is and what the accounts say: far cheaper than save()."""
        return self._clusters.checkpoint(), self.resting.copy(), self._start_energy

    def go_back(self, checkpoint: tuple) -> None:
        """Go on from a checkpoint; see Engine."""
        kept, self.resting[:], self._start_energy = checkpoint
        self._clusters.go_back(kept)
        self._age = KEPT
        self._departure = None
        self._look()

    def close(self) -> None:
        """End the threads."""
        self._clusters.close()

    def _meet(self, duration: float) -> None:
        """See that those go on together who may touch within ``duration`` s; they wake. What sleeps
        on each other stays together.
        """
        if len(self.scene.dolls) == 1:
            return
        rows = self._clusters.rows
        near = self._neighbours.couples(rows, duration, ~self.resting, self.groups)
        self._age += 1
        if (self._clusters.know(near) and not self.resting[near].any()
                and (self._age <= KEPT or self._clusters.all_alone)):
            return
        while True:
            near = self._neighbours.couples(rows, max(duration, AHEAD), ~self.resting,
                                            self.groups)
            if not self.resting[near].any():
                break
            self.resting[near] = False
        asleep = self._clusters.couples
        asleep = asleep[self.resting[asleep].all(axis=1)]
        self._clusters.group(np.unique(np.concatenate([near, asleep]), axis=0))
        self._age = 0

    def _go(self, duration: float, acting: tuple[Wrenches, Springs, Drives],
            accuracy: Accuracy) -> None:
        """Take all clusters on that do not rest."""
        acted = self._act(acting) if any(acting) else ()
        self._clusters.advance(duration, accuracy, self.resting)
        for cluster in acted:
            cluster.use(cluster.course._replace(loads=NO_LOADS, springs=NO_SPRINGS))
            cluster.course.path[:] = 0
        self._show()

    def _show(self) -> None:
        """The state and the sums that all have come to."""
        self._state = State.of(self._clusters.rows.copy())
        self._motion = Motion.of(self._clusters.sums.view(float).reshape(-1, 20).copy())

    def _act(self, acting: tuple[Wrenches, Springs, Drives]) -> list[Cluster]:
        """Enter what acts where it acts; the clusters concerned, whose flights begin anew."""
        acts: dict[int, tuple[list, list, list]] = {}
        for kind, given in enumerate(acting):
            for one in given:
                place = int(self._clusters.of_doll[self.scene.doll_of_bone[one.bone]])
                acts.setdefault(place, ([], [], []))[kind].append(one)
        acted = []
        for place, (loads, hands, drives) in acts.items():
            cluster = self._clusters.members[place]
            bones = cluster.bones.tolist()
            records = cluster.system.tree['bone'].tolist()
            cluster.use(cluster.course._replace(
                loads=load_rows(loads, bones),
                springs=spring_rows(hands, drives, self.scene, bones, records)))
            cluster.course.path[:] = 0
            acted.append(cluster)
        return acted

    def _look(self) -> None:
        """See where all is."""
        self._clusters.advance(0.0, self.accuracy, np.zeros(len(self.resting), bool))
        self._show()

    def _lift_out(self) -> None:
        """Set dolls that are in the ground onto it."""
        if self.scene.ground is None:
            return
        depths = -np.minimum.reduceat(self._heights(self.state),
                                      [own.start for own in self.scene.bone_slices])
        for doll in np.flatnonzero(depths > pressed(self.scene)):
            at = self.layout.root_positions[doll]
            self._clusters.q[at] += depths[doll] * np.array(self.scene.ground.normal)

    def _placed(self) -> GeneralizedState:
        """Where the scene's placements stand."""
        q, v = np.zeros(self.layout.sizes[0]), np.zeros(self.layout.sizes[1])
        for cluster in self._clusters:
            balls = cluster.system.tree[cluster.system.tree['free'] > 0]
            q[cluster.q[balls['q'][balls['parent'] >= 0] + 3]] = 1.0
        for doll, placement in enumerate(self.scene.dolls):
            pose = placement.bone_pose(placement.doll.root)
            q[self.layout.root_positions[doll]] = pose.position
            q[self.layout.root_orientations[doll]] = pose.orientation
            v[self.layout.root_velocities[doll]] = placement.root_velocity()
            v[self._spins[doll]] = placement.spin
        return GeneralizedState(q, v)

    def _estimate_error(self) -> float:
        """Error, m, that the last stretch added to the worst position.

        It is gone again in steps a quarter as long, flights with a hundredth of the error: what is
        of order 2 then errs by a sixteenth.
        """
        if self._departure is None:
            return 0.0
        q, v, duration, acting = self._departure
        finer = dataclasses.replace(self.accuracy, step=FINER * self.accuracy.step,
                                    flight_error=self.accuracy.flight_error / 100)
        here, there = self.save(), self.state.positions
        clusters = self._clusters
        clusters.q[:], clusters.v[:] = q, v
        clusters.gather()
        clusters.forget()
        self._go(duration, acting, finer)
        missed = np.linalg.norm(self.state.positions - there, axis=1).max()
        departure = self._departure
        self.restore(here)
        self._departure = departure
        return float(missed / (1 - FINER ** 2))
